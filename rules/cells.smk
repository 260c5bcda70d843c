"""What is compared: the cells of the config's `lod`, `calibration`, `benchmark`, `seam_study`, `perceptual_study`, `sweeps`,
`tradeoff` and `auto`, with the files of each."""

from itertools import product

from dav_gswt.sweeps import grid
from dav_gswt.tradeoff import settings


def measured_of_tiles(made, entry="lod"):
    """The tables of levels, orders or frames that are gathered: the path of each one's, and what tells it from the others."""
    found = {}
    asked = config[entry]
    told = ("scene", "seed", "quality", "seam") + (("tau",) if "tau" in made.output.table else ())
    for scene in asked["scenes"]:
        chosen = chosen_values(scene, asked["fixed"]) if "fixed" in asked else values_of(scene)
        for seed in asked.get("seeds", config["seeds"]):
            values = chosen | {"seed": seed}
            (path,) = expand(made.output.table, **values)
            found[path] = {key: values[key] for key in told}
    return found


def calibrations():
    """The cells that are compared: the path of each one's calibration.json, and what tells it from the others."""
    asked, found = config["calibration"], {}
    for scene in asked["scenes"]:
        values = values_of(scene, asked["policy"])
        for seed in config["seeds"]:
            for t in range(asked["rounds"] + 1):
                made = rules.calibrate_round if t else rules.calibrate_coarse
                (path,) = expand(made.output.found, **(values | {"seed": seed, "t": t}))
                cell = {key: values[key] for key in ("scene", "quality", "policy", "prior", "p_drop")}
                found[path] = cell | {"seed": seed, "round": t}
    return found


def compared_cells():
    """The cells of the config's `benchmark`: what tells each from the others, and the files that tell of its rounds."""
    asked, cells = config["benchmark"], []
    for group in asked["sets"]:
        for scene, policy, seed, k in product(
            group["scenes"], group.get("policies", asked["policies"]), asked["seeds"], group["k"]
        ):
            policy = {"policy": policy} if isinstance(policy, str) else policy
            if policy["policy"] != "all" or k == group["k"][0]:  # all of the pool is one round, whatever k is
                cells.append(compared_cell(scene, policy, seed, k, group["photos"]))
    return cells


def compared_cell(scene, asked, seed, k, photos):
    """One of them: rounds of k from the scene's start until there are so many photos."""
    entry, policy = config["scenes"][scene], asked["policy"]
    rounds = 1 if policy == "all" else (photos - entry["start"]) // k
    own = {
        key: asked[key] if key == "prior" else spell(asked[key]) for key in ("prior", "p_drop", "lam") if key in asked
    }
    values = values_of(scene, policy) | own | {"seed": seed, "k": k, "stop": ""}
    before, after = range(1, rounds), range(1, rounds + 1)

    def of(first, later, ts):
        return expand(first, **values) + expand(later, **(values | {"t": ts}))

    jobs = [of(rules.score_coarse.benchmark, rules.score_round.benchmark, before)]
    jobs += [of([], job.benchmark, after) for job in (rules.select_poses, rules.capture_views, rules.update_field)]
    prior = config["priors"].get(values["prior"], {"samples": 0})
    return {key: values[key] for key in ("scene", "seed", "quality", "policy", "prior", "p_drop", "lam", "k")} | {
        "corrected": entry["kind"] == "photos",
        "samples": prior["samples"],
        "metrics": of(rules.evaluate_coarse.output.metrics, rules.evaluate_round.output.metrics, after),
        "facts": of(rules.score_coarse.output.facts, rules.score_round.output.facts, before),
        "times": [list(of_round) for of_round in zip(*jobs, strict=True)],
    }


def seam_values(scene, variant=None):
    """The wildcards of a scene's tiles as they are measured: cut as its own entry says, or as another one."""
    values = values_of(scene)
    return values | ({"seam": variant} if variant else {})


def seam_cells():
    """What tells each cell from the others, and its files; a scene's own seam is always among its variants, each drawn
    as often as is asked for."""
    asked, cells = config["seam_study"], []
    for scene in asked["scenes"]:
        own = config["scenes"][scene]["seam"]
        variants = [
            (variant, name, draw)
            for variant in dict.fromkeys([*asked["seams"], own])
            for draw, name in enumerate(draws.asked(variant, own, asked))
        ]
        for (variant, entry, draw), seed in product(variants, config["seeds"]):
            values = seam_values(scene, entry) | {"seed": seed}
            files = {"table": rules.measure_seams.output.crops, "facts": rules.measure_seams.output.facts}
            files |= {} if draw else {"repeats": rules.measure_repetition.output.table}
            (cell,) = [{name: expand(path, **values)[0] for name, path in files.items()}]
            about = {key: values[key] for key in ("scene", "seed", "quality")}
            cells.append(about | {"variant": variant, "draw": draw} | cell)
    return cells


def seam_pictures():
    """What rule draw_grid draws of each scene, in the order of its shots."""
    drawn = list(rules.draw_grid.output.pictures)
    return {scene: expand(drawn, **seam_values(scene)) for scene in config["seam_study"]["scenes"]}


def perceptual_seams():
    """The entries of `seams` that are compared, by name: of other sizes, tiles have no place in common."""
    names = dict.fromkeys(name for pair in config["perceptual_study"]["pairs"] for name in pair)
    found = {name: config["seams"][name] for name in names if name != FLOOR}
    if len({tuple(entry[key] for key in ("tile", "strip", "variants")) for entry in found.values()}) > 1:
        raise WorkflowError(
            "config: perceptual_study.pairs: seams of other `tile`, `strip` or `variants` have no place in common; "
            f"name such that are only cut in other ways ({', '.join(found)} are not)"
        )
    return found


def perceptual_inputs(wildcards):
    """A scene's levels, its tiles of each seam, LPIPS's weights where they are."""
    values = seam_values(wildcards.scene) | {"seed": config["seeds"][0]}
    made, names = rules.cut_tiles.output, list(perceptual_seams())
    found = {"levels": expand(rules.make_levels.output.levels, **values)[0]}
    found |= {"seams": expand(made.seams, **(values | {"seam": names}))}
    found |= {"tiles": expand(made.tiles, **(values | {"seam": names}))}
    return found | lpips_if_fetched(wildcards)


def answers_given(wildcards):
    """The files of answers, where there are any yet."""
    folder = Path(config["perceptual_study"]["answers"])
    found = sorted(str(p) for p in folder.glob("*.json") if p.is_file() and not p.name.startswith("."))
    return {"answers": found} if found else {}


def sweep_cells(name):
    """The cells of a row of the config's `sweeps`: what tells each from the others, what it varied, and its files."""
    asked, cells = config["sweeps"][name], {}
    for chosen in grid.combinations(asked["vary"], asked.get("fixed", {})):
        for scene, seed in product(asked["scenes"], grid.seeds_of(asked["measure"])):
            values = chosen_values(scene, chosen) | {"seed": seed}
            measured = [key for key, seeds in asked["measure"].items() if seed in seeds]
            cell = sweep_cell(values, measured) | {"sweep": name, "varied": chosen["shown"]}
            cells.setdefault(tuple(cell[key] for key in grid.CELL), cell)
    return list(cells.values())


def chosen_values(scene, chosen):
    """The wildcards of a cell of settings of its own, which stops nowhere before its last round and paints nothing."""
    entry, over = config["scenes"][scene], {key: value for key, value in chosen.items() if key != "shown"}
    asked = config | over
    rounds = grid.rounds_of(over, asked["policy"], grid.start_of(entry), asked["k"], asked["rounds"])
    return values_of(scene, over=over | {"rounds": rounds}) | {"stop": "", "completed": ""}


def sweep_cell(values, measured):
    """One of them. measured: keys of `measure` that hold for it."""
    rounds, scene = values["t"], config["scenes"][values["scene"]]

    def of(found, ts=None):
        return expand(found, **(values if ts is None else values | {"t": list(ts)}))

    tested = rules.evaluate_round if rounds else rules.evaluate_coarse
    files = {
        "views": {"metrics": tested.output.metrics},
        "tiles": {"manifest": rules.bundle_tiles.output.manifest},
        "seams": {"crops": rules.measure_seams.output.crops, "facts": rules.measure_seams.output.facts},
        "stills": {"still": rules.render_terrain.output.stills[0]},
    }
    rounds_before, after = range(1, rounds), range(1, rounds + 1)
    times = {"coarse": of(rules.fit_coarse.benchmark)}
    times["score"] = (of(rules.score_coarse.benchmark) if rounds else []) + of(
        rules.score_round.benchmark, rounds_before
    )
    for key, job in (("select", rules.select_poses), ("capture", rules.capture_views), ("update", rules.update_field)):
        times[key] = of(job.benchmark, after)
    if {"tiles", "seams", "stills"} & set(measured):
        times |= {"levels": of(rules.make_levels.benchmark), "cut": of(rules.cut_tiles.benchmark)}
    times |= {"bundle": of(rules.bundle_tiles.benchmark)} if {"tiles", "stills"} & set(measured) else {}
    times |= {"stills": of(rules.render_terrain.benchmark)} if "stills" in measured else {}
    prior = config["priors"].get(values["prior"], {"samples": 0, "steps": 0})
    told = {key: values[key] for key in grid.CELL if key != "rounds"} | {"rounds": rounds}
    return told | {
        "corrected": scene["kind"] == "photos",
        "samples": prior["samples"],
        "steps": prior["steps"],
        "files": {key: of(path)[0] for part in measured for key, path in files[part].items()},
        "times": times,
    }


def tradeoff_cells():
    """A cell for every setting of every knob, each knob's most accurate first."""
    asked, size = config["tradeoff"], settings.tested_size(config)
    return [
        {"knob": s.knob, "setting": s.shown, "most": s.most, "base": s.base, "measure": s.measure}
        | tradeoff_cell(asked["scene"], asked["seed"], s.chosen, size, s.measure)
        for s in settings.settings(config)
    ]


def auto_cells():
    """Of each scene of `auto`: the base, then with each of what is chosen by itself alone, then with all of them."""
    asked = config["auto"]
    chosen, base = asked["auto"], asked["base"]["quality"]
    size = config["qualities"][settings.sized(config, base)]["size"]
    parts = {
        "base": {"quality": settings.sized(config, base)},
        "fit": {"quality": settings.sized(config, chosen["quality"])},
        "rounds": {"stop": {"worth": chosen["worth"]}},
        "orders": {"tau": chosen["tau"]},
    }
    parts["all"] = {key: value for part in parts.values() for key, value in part.items()}
    return [
        {"part": part} | tradeoff_cell(scene, asked["seed"], asked["base"] | parts["base"] | own, size, "stills")
        for scene in asked["scenes"]
        for part, own in parts.items()
    ]


def tradeoff_cell(scene, seed, chosen, size, measure):
    """One of them. size: of the photos that all are tested on, whatever they were fitted to."""
    stop = chosen.get("stop", {})
    others = {key: value for key, value in chosen.items() if key != "stop"}
    values = chosen_values(scene, others) | {"seed": seed, "stop": spell_stop(stop)}
    cell = sweep_cell(values, ["views", "tiles", measure])
    (metrics,) = expand(rules.evaluate_at.output.metrics, size=size, **values)
    rounds = expand(rules.update_field.output.fit, **(values | {"t": range(1, values["t"] + 1)}))
    return cell | {
        "sweep": "tradeoff",
        "varied": {},
        "files": cell["files"] | {"metrics": metrics},
        "fits": expand(rules.fit_coarse.output.fit, **values) + rounds,
        "stills": expand(rules.render_terrain.output.stills, **values) if measure == "stills" else [],
    }


def files_of(cells):
    """Everything that cells are read from, but for benchmarks."""
    return [path for cell in cells for path in [*cell["files"].values(), *cell["fits"], *cell["stills"]]]
