"""Experiments of presets: what `preset_costs` gathers, each with its files and its jobs' benchmarks."""

from dav_gswt.cli import estimate

# jobs of a run before the start photos are there, beside its products, and after the bundle
UNCOUNTED = ("render_photos", "register_photos", "report_photos", "split_views", "capture_views")
UNCOUNTED += ("copy_chosen_photos", "evaluate_coarse", "evaluate_round", "render_terrain", "make_page")


def preset_experiments():
    """Of each scene of `preset_costs` a cell for each preset: its files, and the benchmarks of the jobs that count."""
    asked = STUDY["preset_costs"]
    return [preset_experiment(scene, preset) for scene in asked["scenes"] for preset in asked["presets"]]


def preset_experiment(scene, preset):
    """One of them."""
    asked, entry = STUDY["preset_costs"], config["scenes"][scene]
    values = branch(scene, changes={"preset": preset}) | {"seed": asked["seed"], "stop": "", "inpainted": ""}
    chosen = values_of_choice(values)
    after, before = {"t": range(1, values["t"] + 1)}, {"t": range(1, values["t"])}

    def of(path, wildcards=values, **ts):
        return expand(path, **(wildcards | ts))

    told = [] if entry.get("materials", "one") == "one" else of(rules.find_materials.benchmark)
    tiles = [of(job.benchmark) for job in (rules.make_levels, rules.cut_tiles, rules.bundle_tiles)]
    return {
        "scene": scene,
        "preset": preset,
        "corrected": entry["kind"] == "photos",
        "fitted": config["presets"][preset]["size"],
        "cost": estimate_tiles(scene, preset),
        "images": of(rules.register_photos.output.images)[0],
        "metrics": of(rules.evaluate_at.output.metrics, size=asked["size"])[0],
        "manifest": of(rules.bundle_tiles.output.manifest)[0],
        "times": {
            "fits": of(rules.fit_coarse.benchmark, chosen) + benchmark_fits(values),
            "views": of(rules.score_coarse.benchmark, chosen)
            + of(rules.score_round.benchmark, chosen, **before)
            + of(rules.select_poses.benchmark, chosen, **after),
            "tiles": told + [path for job in tiles for path in job],
        },
    }


def estimate_tiles(scene, preset):
    """Seconds that `make run` expects of the jobs whose times count on the reference machine: general, rasterizer."""
    jobs = estimate.count_jobs(config | {"scene": scene}, preset)
    counted = {rule: count for rule, count in jobs.items() if rule not in UNCOUNTED}
    counted |= {"score_round": config["rounds"] - 1}  # that after the last round chooses no photo
    work = estimate.describe_work(config | {"scene": scene}, preset)
    cost = estimate.add_costs(counted, work)
    return [round(cost.general, 1), round(cost.raster, 1)]
