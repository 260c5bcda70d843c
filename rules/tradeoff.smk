"""Speed against accuracy: every setting of the config's `tradeoff` as a cell, and what `auto` chose.

In: what each cell left, and its jobs' benchmarks; a cell is restarted by itself, and what cells have in common is made
once. Out: results/tradeoff/{tradeoff,pareto,auto}.csv, {pareto,knobs}.png; docs/data/tradeoff.csv and auto.csv, where runs
add up; docs/tradeoff.md and docs/auto.md. Not part of `all`: `snakemake tradeoff` makes it. Seconds differ from machine
to machine: one that is otherwise idle is to run all of it.
"""

from dav_gswt.tradeoff.settings import settings as tradeoff_settings


def tradeoff_cells():
    """A cell for every setting of every knob, each knob's most accurate first."""
    asked = config["tradeoff"]
    size = config["qualities"][asked["base"]["quality"]]["size"]
    return [
        {"knob": s.knob, "setting": s.shown, "most": s.most, "measure": s.measure}
        | tradeoff_cell(asked["scene"], asked["seed"], s.chosen, size, s.measure)
        for s in tradeoff_settings(config)
    ]


def auto_cells():
    """Of each scene of `auto`: the base, then with each of what is chosen by itself alone, then with all of them."""
    asked = config["auto"]
    chosen, size = asked["auto"], config["qualities"][asked["base"]["quality"]]["size"]
    parts = {
        "base": {},
        "fit": {"quality": chosen["quality"]},
        "rounds": {"stop": {"worth": chosen["worth"]}},
        "orders": {"tau": chosen["tau"]},
    }
    parts["all"] = {key: value for part in parts.values() for key, value in part.items()}
    return [
        {"part": part} | tradeoff_cell(scene, asked["seed"], asked["base"] | own, size, "stills")
        for scene in asked["scenes"]
        for part, own in parts.items()
    ]


def tradeoff_cell(scene, seed, chosen, size, measure):
    """One of them. size: of the photos that all are tested on, whatever they were fitted to."""
    stop = chosen.get("stop", {})
    settings = {key: value for key, value in chosen.items() if key != "stop"}
    values = chosen_values(scene, settings) | {"seed": seed, "stop": spell_stop(stop)}
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


use rule evaluate_round as evaluate_at with:
    output:
        metrics="<results>/<round>/metrics_{size}.json",
    log:
        "<logs>/<round>/evaluate_at_{size}.log",
    benchmark:
        "<benchmarks>/<round>/evaluate_at_{size}.tsv"
    params:
        quality=lambda wildcards: config["qualities"][wildcards.quality] | {"size": int(wildcards.size)},
        t=integer("t"),
        source=source_of("metrics", "active/evaluation", "active/stopping", "perceptual", "raster"),


rule gather_tradeoff:
    """What every setting costs, what it is worth, and which of them nothing else beats."""
    input:
        measured=lambda wildcards: files_of(tradeoff_cells()),
    output:
        table="results/tradeoff/tradeoff.csv",
        pareto="results/tradeoff/pareto.csv",
        kept=update("docs/data/tradeoff.csv"),
    log:
        "<logs>/tradeoff/gather_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/gather_tradeoff.tsv"
    params:
        cells=lambda wildcards: tradeoff_cells(),
        source=source_of("tradeoff", "sweeps", "seams", "active/comparison/curves", "figures", "provenance"),
    script:
        "../scripts/gather_tradeoff.py"


rule plot_tradeoff:
    """Draw what settings are worth over their time: all of them with their front, and knob by knob."""
    input:
        table=rules.gather_tradeoff.output.table,
        pareto=rules.gather_tradeoff.output.pareto,
    output:
        pareto=report("results/tradeoff/pareto.png", caption="../workflow/report/tradeoff.rst", category="Trade-off"),
        knobs=report("results/tradeoff/knobs.png", caption="../workflow/report/tradeoff.rst", category="Trade-off"),
    log:
        "<logs>/tradeoff/plot_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/plot_tradeoff.tsv"
    params:
        source=source_of("tradeoff", "figures"),
    script:
        "../scripts/plot_tradeoff.py"


rule write_tradeoff:
    """Which settings are worth their time, in words."""
    input:
        table=rules.gather_tradeoff.output.table,
        pareto=rules.gather_tradeoff.output.pareto,
        figures=rules.plot_tradeoff.output,
    output:
        page="docs/tradeoff.md",
        figures=expand("docs/figures/tradeoff_{shown}.png", shown=["pareto", "knobs"]),
    log:
        "<logs>/tradeoff/write_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/write_tradeoff.tsv"
    params:
        source=source_of("tradeoff"),
    script:
        "../scripts/write_tradeoff.py"


rule gather_auto:
    """What `auto` chose for each scene, what fixed settings cost instead, and what was lost."""
    input:
        measured=lambda wildcards: files_of(auto_cells()),
    output:
        table="results/tradeoff/auto.csv",
        kept=update("docs/data/auto.csv"),
        page="docs/auto.md",
    log:
        "<logs>/tradeoff/gather_auto.log",
    benchmark:
        "<benchmarks>/tradeoff/gather_auto.tsv"
    params:
        cells=lambda wildcards: auto_cells(),
        source=source_of("tradeoff", "sweeps", "seams", "active/comparison/curves", "figures", "provenance"),
    script:
        "../scripts/gather_auto.py"


rule tradeoff:
    """Speed against accuracy: tables, figures and pages."""
    input:
        rules.write_tradeoff.output,
        rules.gather_auto.output,


localrules:
    tradeoff,
