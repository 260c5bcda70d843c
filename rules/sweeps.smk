"""Sweeps: what one setting changes, and the time of each stage. Not part of `all`: `snakemake sweeps`.

In: the runs of the config's scene for each value of the config's `sweeps`, the other settings as the config has them; what runs
have in common is made once. Out: results/sweeps/{sweep}.csv, results/tables/timing.csv.
"""

SWEPT_POLICY = "w2-lpips"  # the paper's, where the config's policy does not sample the prior


def experiment_branch(scene, changes):
    """The wildcards of a run with settings that replace the config's. No round stops early, and nothing is inpainted."""
    return branch(scene, changes=changes) | {"stop": "", "inpainted": ""}


def sweep_cells(sweep):
    """The cells of a sweep: for each value and seed the settings, the files and the benchmarks of a run."""
    scene, cells = config["scene"], {}
    if config["scenes"][scene]["kind"] == "field":
        raise WorkflowError(f"sweeps: {scene} is a finished field; a sweep needs a scene with photos")
    policy = config["policy"] if config["policy"] in PRIOR_POLICIES else SWEPT_POLICY
    for value in config["sweeps"][sweep]:
        values = experiment_branch(scene, {"policy": policy, sweep: value})
        for seed in config["seeds"]:
            cell = describe_run(values | {"seed": seed}, ["views", "tiles"])
            cells.setdefault(tuple(cell[key] for key in CELL), cell)
    return list(cells.values())


def describe_run(values, measured):
    """A cell: the settings of a run, the files that measure it, and the benchmarks of its jobs.

    measured: any of views (the last field's metrics), tiles (the bundle) and stills.
    """
    rounds, chosen = values["t"], values_of_choice(values)

    def of(made, ts=None, wildcards=values):
        return expand(made, **(wildcards if ts is None else wildcards | {"t": list(ts)}))

    tested = rules.evaluate_round if rounds else rules.evaluate_coarse
    files = {"metrics": tested.output.metrics} if "views" in measured else {}
    files |= {"manifest": rules.bundle_tiles.output.manifest} if "tiles" in measured else {}
    files |= {"still": rules.render_terrain.output.stills[0]} if "stills" in measured else {}
    times = {"coarse": of(rules.fit_coarse.benchmark, [rounds], chosen)}
    times["update"] = of(rules.update_field.benchmark, range(1, rounds + 1), chosen)
    times["update"] += of(rules.fit_chosen_photos.benchmark) if chosen != values else []
    times["score"] = of(rules.score_coarse.benchmark, [rounds], chosen) if rounds else []
    times["score"] += of(rules.score_round.benchmark, range(1, rounds), chosen)
    for key, job in (("select", rules.select_poses), ("capture", rules.capture_views)):
        times[key] = of(job.benchmark, range(1, rounds + 1), chosen)
    if measured != ["views"]:
        times |= {"levels": of(rules.make_levels.benchmark), "cut": of(rules.cut_tiles.benchmark)}
    times |= {"bundle": of(rules.bundle_tiles.benchmark)} if {"tiles", "stills"} & set(measured) else {}
    times |= {"stills": of(rules.render_terrain.benchmark)} if "stills" in measured else {}
    cell = {key: values[key] for key in CELL if key != "rounds"} | {"rounds": rounds}
    corrected = config["scenes"][values["scene"]]["kind"] == "photos"
    return cell | {"corrected": corrected, "files": {key: of(path)[0] for key, path in files.items()}, "times": times}


def timed_cells():
    """The cells of the timing table: the swept scene with the config's settings."""
    policy = config["policy"] if config["policy"] in PRIOR_POLICIES else SWEPT_POLICY
    values = experiment_branch(config["scene"], {"policy": policy})
    return [describe_run(values | {"seed": seed}, ["views", "tiles", "stills"]) for seed in config["seeds"]]


rule gather_sweep:
    """Collect what each value of a setting changes, and what it costs."""
    input:
        measured=lambda wildcards: [path for cell in sweep_cells(wildcards.sweep) for path in cell["files"].values()],
    output:
        table=report("results/sweeps/{sweep}.csv", category="Sweeps", labels={"sweep": "{sweep}"}),
    log:
        "<logs>/sweeps/gather_{sweep}.log",
    benchmark:
        "<benchmarks>/sweeps/gather_{sweep}.tsv"
    wildcard_constraints:
        sweep="|".join(config["sweeps"]) or NEVER,
    params:
        cells=lambda wildcards: sweep_cells(wildcards.sweep),
        source=code_of("gather_sweep"),
    script:
        "../scripts/gather_sweep.py"


rule tabulate_timing:
    """The time of each stage of a run."""
    input:
        measured=lambda wildcards: [path for cell in timed_cells() for path in cell["files"].values()],
    output:
        table=report("results/tables/timing.csv", category="Tables", labels={"table": "timing"}),
    log:
        "<logs>/tables/timing.log",
    benchmark:
        "<benchmarks>/tables/timing.tsv"
    params:
        cells=lambda wildcards: timed_cells(),
        source=code_of("tabulate_timing"),
    script:
        "../scripts/tabulate_timing.py"


rule sweeps:
    """The tables of all sweeps of the config, and the timing table."""
    input:
        expand("results/sweeps/{sweep}.csv", sweep=config["sweeps"]),
        "results/tables/timing.csv",


localrules:
    sweeps,  # makes nothing itself
