"""Experiments: what the study's tables and figures are made from, each with its settings and its files."""

from itertools import product

from dav_gswt_study import experiments

SHOWN = {  # figures of a scene in the page of results
    "sphere": "scores of the candidates, and the chosen candidates",
    "evolution": "two test views after the first rounds",
    "estimators": "test views after the same number of photos, chosen by each estimator",
    "cuts": "cuts by colour, and semantic cuts",
    "uncertainty": "uncertainty of tiles, and a path over them",
}
FRAMES = "study/results/tables/viewer.csv"
FLAT = config | STUDY  # the study's tables beside the product's


def viewer_times(wildcards):
    """What a browser measured of bundles, where the config's `study.tables.viewer` asks for it."""
    return {"viewer": FRAMES} if STUDY["tables"]["viewer"] else {}


def plain_tiling(wildcards):
    """The entry of `tilings` that a tiling is made of."""
    return experiments.split_tiling(wildcards.tiling)[0]


def made_of(scene):
    """The wildcards of what is made of a scene with the config's first seed."""
    return branch(scene) | {"seed": config["seeds"][0]}


def measured_of_tiles(made, entry="lod"):
    """The tables of levels, orders or frames that are gathered: the path of each one's, and what tells it from the others."""
    found = {}
    asked = STUDY[entry]
    keys = ("scene", "seed", "preset", "tiling") + (("tau",) if "tau" in made.output.table else ())
    for scene in asked["scenes"]:
        chosen = study_branch(scene, asked["fixed"]) if "fixed" in asked else branch(scene)
        for seed in asked.get("seeds", config["seeds"]):
            values = chosen | {"seed": seed}
            (path,) = expand(made.output.table, **values)
            found[path] = {key: values[key] for key in keys}
    return found


def calibrations():
    """The cells that are compared: the path of each one's calibration.json, and what tells it from the others."""
    asked, found = STUDY["calibration"], {}
    for scene in asked["scenes"]:
        values = branch(scene, asked["policy"])
        for seed in config["seeds"]:
            for t in range(asked["rounds"] + 1):
                made = rules.calibrate_round if t else rules.calibrate_coarse
                (path,) = expand(made.output.found, **(values | {"seed": seed, "t": t}))
                cell = {key: values[key] for key in ("scene", "preset", "policy", "prior", "p_drop")}
                found[path] = cell | {"seed": seed, "round": t}
    return found


def benchmark_experiments():
    """The cells of the config's `benchmark`: what tells each from the others, and the files that tell of its rounds."""
    asked, cells = STUDY["view_benchmark"], []
    for group in asked["sets"]:
        for scene, policy, seed, k in product(
            group["scenes"], group.get("policies", asked["policies"]), group.get("seeds", asked["seeds"]), group["k"]
        ):
            if policy != experiments.EVERYTHING or k == group["k"][0]:  # all of the pool is one round, whatever k is
                cells.append(benchmark_experiment(scene, policy, seed, k, group))
    return cells


def benchmark_experiment(scene, policy, seed, k, group):
    """One of them: rounds of k from the scene's start until there are as many photos as the set asks for."""
    entry = config["scenes"][scene]
    rounds = experiments.count_rounds(group, policy, entry["start"], k, 0)
    preset = {key: group[key] for key in ("preset",) if key in group}
    values = branch(scene, policy, preset) | {"seed": seed, "k": k}
    chosen, before, after = values_of_choice(values), range(1, rounds), range(1, rounds + 1)

    def of(first, later, ts, wildcards=values):
        return expand(first, **wildcards) + expand(later, **(wildcards | {"t": ts}))

    jobs = [of(rules.score_coarse.benchmark, rules.score_round.benchmark, before, chosen)]
    of_round = (rules.select_poses, rules.capture_views, rules.update_field)
    jobs += [of([], job.benchmark, after, chosen) for job in of_round]
    jobs += [of([], rules.fit_chosen_photos.benchmark, after)] * (chosen != values)
    return {key: values[key] for key in ("scene", "seed", "preset", "policy", "prior", "p_drop", "lam", "k")} | {
        "corrected": entry["kind"] == "photos",
        "metrics": of(rules.evaluate_coarse.output.metrics, rules.evaluate_round.output.metrics, after),
        "times": [list(of_round) for of_round in zip(*jobs, strict=True)],
    }


def seam_branch(scene, variant=None):
    """The wildcards of a scene's tiles as they are measured: cut as its own entry says, or as another one."""
    values = branch(scene)
    return values | ({"tiling": variant} if variant else {})


def seam_experiments():
    """What tells each cell from the others, and its files; a scene's own seam is always among its variants, each drawn
    as often as is asked for."""
    asked, cells = STUDY["seams"], []
    for scene in asked["scenes"]:
        own = config["scenes"][scene]["tiling"]
        variants = [
            (variant, name, number)
            for variant in dict.fromkeys([*asked["tilings"], own])
            for number, name in enumerate(experiments.list_replicates(variant, own, asked))
        ]
        for (variant, entry, number), seed in product(variants, config["seeds"]):
            values = seam_branch(scene, entry) | {"seed": seed}
            files = {"table": rules.measure_seams.output.crops, "facts": rules.measure_seams.output.facts}
            about = {key: values[key] for key in ("scene", "seed", "preset")} | {
                "variant": variant,
                "replicate": number,
            }
            cells.append(about | {name: expand(path, **values)[0] for name, path in files.items()})
    return cells


def compared_tilings():
    """The entries of `tilings` that people compare, by name."""
    names = dict.fromkeys(name for pair in STUDY["forced_choice"]["pairs"] for name in pair if name != FLOOR)
    return {name: config["tilings"][experiments.split_tiling(name)[0]] for name in names}


def pair_inputs(wildcards):
    """A scene's levels, and its tiles of each seam."""
    values = seam_branch(wildcards.scene) | {"seed": config["seeds"][0]}
    made, names = rules.cut_tiles.output, list(compared_tilings())
    tiles = {
        key: expand(path, **(values | {"tiling": names}))
        for key, path in (("seams", made.seams), ("tiles", made.tiles))
    }
    return tiles | {"levels": expand(rules.make_levels.output.levels, **values)[0]}


def saved_answers(wildcards):
    """The files of answers, where there are any yet."""
    found = sorted(map(str, Path(STUDY["forced_choice"]["answers"]).glob("[!.]*.json")))
    return {"answers": found} if found else {}


def sweep_experiments(name):
    """The cells of a row of the config's `sweeps`: what tells each from the others, what it varied, and its files."""
    asked, cells = STUDY["sweeps"][name], {}
    for chosen in experiments.list_combinations(asked["vary"], asked.get("fixed", {})):
        for scene, seed in product(asked["scenes"], experiments.list_seeds(asked["measure"])):
            values = study_branch(scene, chosen) | {"seed": seed}
            measured = [key for key, seeds in asked["measure"].items() if seed in seeds]
            cell = describe_experiment(values, measured) | {"sweep": name, "varied": chosen["shown"]}
            cells.setdefault(tuple(cell[key] for key in CELL), cell)
    return list(cells.values())


def study_branch(scene, chosen):
    """The wildcards of a cell of settings of its own, which may give the photos that it ends with instead of its rounds."""
    entry, over = config["scenes"][scene], {key: value for key, value in chosen.items() if key != "shown"}
    asked = config | over
    rounds = experiments.count_rounds(
        over, asked["policy"], experiments.count_start_photos(entry), asked["k"], asked["rounds"]
    )
    return experiment_branch(scene, over | {"rounds": rounds})


def describe_experiment(values, measured):
    """A cell of the product's sweeps, with its seams where they are measured, and how its prior samples."""
    cell = describe_run(values, [key for key in ("views", "tiles", "stills") if key in measured])
    if "seams" in measured:
        made = rules.measure_seams.output
        cell["files"] |= {
            key: expand(path, **values)[0] for key, path in (("crops", made.crops), ("facts", made.facts))
        }
        jobs = {"levels": rules.make_levels, "cut": rules.cut_tiles}
        cell["times"] |= {key: expand(job.benchmark, **values) for key, job in jobs.items()}
    prior = config["priors"].get(values["prior"], {"samples": 0, "steps": 0})
    return cell | {"samples": prior["samples"], "steps": prior["steps"]}


def tradeoff_experiments():
    """A cell for every setting of every knob, each knob's most accurate first."""
    asked, size = STUDY["tradeoff"], experiments.find_test_size(FLAT)
    return [
        {"knob": s.knob, "setting": s.shown, "most": s.most, "base": s.base, "measure": s.measure}
        | tradeoff_experiment(asked["scene"], asked["seed"], s.chosen, size, s.measure)
        for s in experiments.list_settings(FLAT)
    ]


def tradeoff_experiment(scene, seed, chosen, size, measure):
    """One of them. size: of the photos that all are tested on, whatever they were fitted to."""
    values = study_branch(scene, chosen) | {"seed": seed}
    cell = describe_experiment(values, ["views", "tiles", measure])
    (metrics,) = expand(rules.evaluate_at.output.metrics, size=size, **values)
    return cell | {
        "sweep": "tradeoff",
        "varied": {},
        "files": cell["files"] | {"metrics": metrics},
        "stills": expand(rules.render_terrain.output.stills, **values) if measure == "stills" else [],
    }


def files_of(cells):
    """Everything that cells are read from, but for benchmarks."""
    return [path for cell in cells for path in [*cell["files"].values(), *cell.get("stills", [])]]


def preset_experiments():
    """The cells of `preset_costs`, a scene and a preset each."""
    asked = STUDY["preset_costs"]
    return [preset_experiment(scene, preset) for scene in asked["scenes"] for preset in asked["presets"]]


def preset_experiment(scene, preset):
    """One of them: its files, and the benchmarks of jobs by what they do."""
    asked = STUDY["preset_costs"]
    values = experiment_branch(scene, {"preset": preset}) | {"seed": asked["seed"]}
    cell = describe_run(values, ["views", "tiles"])
    (metrics,) = expand(rules.evaluate_at.output.metrics, size=asked["size"], **values)
    told = [] if config["scenes"][scene].get("materials", "one") == "one" else [rules.find_materials]
    parts = {"fits": ("coarse", "update"), "views": ("score", "select"), "tiles": ("levels", "cut", "bundle")}
    times = {part: [path for job in jobs for path in cell["times"][job]] for part, jobs in parts.items()}
    times["tiles"] += [path for job in told for path in expand(job.benchmark, **values)]
    return cell | {"files": cell["files"] | {"metrics": metrics}, "times": times}


def tabled_sweeps():
    """The sweeps that the paper's tables are made from."""
    asked = STUDY["tables"]
    return list(dict.fromkeys([asked["timing"], *asked["sensitivity"], *asked["ablation"]]))


def setting_of(sweep):
    """What a sweep varies."""
    return next(iter(STUDY["sweeps"][sweep]["vary"]))


def estimator_branch(scene, policy):
    """The wildcards of what the study's figures show of a scene after a policy chose."""
    asked = STUDY["tables"]["figures"]
    return study_branch(scene, {"policy": policy, "rounds": asked["rounds"]}) | {"seed": asked["seed"]}


def of_estimators(output):
    """An input function: a file of each estimator that the study's figure shows."""
    return lambda wildcards: [
        expand(output, **estimator_branch(wildcards.scene, policy))[0]
        for policy in STUDY["tables"]["figures"]["estimators"]
    ]


def figure_files():
    """The paper's figures: the path of each, by its name in docs/figures; they are of scenes, seed and policy of `study`."""
    asked, found = STUDY["tables"]["figures"], {}
    drawn = (
        rules.plot_sphere,
        rules.plot_evolution,
        rules.plot_estimators,
        rules.plot_cuts,
        rules.plot_tile_uncertainty,
    )
    for scene in asked["scenes"]:
        values = estimator_branch(scene, asked["policy"])
        found |= {
            f"{name}_{scene}": expand(rule.output.plot, **values)[0] for name, rule in zip(SHOWN, drawn, strict=True)
        }
    return found | {"budget": "study/results/sweeps/budget.png"}


def kept_suffix(name):
    """The ending of a figure of the study in docs/figures: those of photos are a fifth as large as JPEGs."""
    return ".jpg" if name.startswith(("evolution", "estimators", "cuts")) else ".png"


def captions():
    """What the figures of the study show, in their order."""
    return [f"{scene}: {SHOWN[name]}" for name, _, scene in (n.partition("_") for n in figure_files()) if scene] + [
        "quality against the number of photos"
    ]


def deciding_scores(wildcards):
    """The scores that rounds 1 to t chose by: those that the round before left."""
    return ["<results>/<scored>/scores.csv", *(f"{round_folder(t)}/scores.csv" for t in range(1, int(wildcards.t)))]


def poses_until(wildcards):
    """The poses that rounds 1 to t chose."""
    return [f"{round_folder(t)}/poses.json" for t in range(1, int(wildcards.t) + 1)]


def figure_rounds(wildcards):
    """The rounds of the evolution figure: none, the first, and round t."""
    return sorted({0, 1, int(wildcards.t)})


def in_figure_rounds(file):
    """An input function: a file as each round of the evolution figure left it."""
    return lambda wildcards: [f"{round_folder(t)}/{file}" for t in figure_rounds(wildcards)]
