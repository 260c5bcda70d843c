"""Experiments of presets: what `preset_costs` gathers, each with its files and its jobs' benchmarks."""


def preset_experiments():
    """Of each scene of `preset_costs` a cell for each preset: its files, and the benchmarks of the jobs that count."""
    asked = STUDY["preset_costs"]
    return [preset_experiment(scene, preset) for scene in asked["scenes"] for preset in asked["presets"]]


def preset_experiment(scene, preset):
    """One of them."""
    asked, entry = STUDY["preset_costs"], config["scenes"][scene]
    values = branch(scene, changes={"preset": preset}) | {"seed": asked["seed"], "inpainted": ""}
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
