"""Speed against accuracy: every setting of the config's `tradeoff` as a cell, and what `auto` chose.

In: what each cell left, and its jobs' benchmarks; a cell is restarted by itself, and what cells have in common is made
once. Out: results/tradeoff/{tradeoff,pareto,auto}.csv, {pareto,knobs}.png; docs/research/data/tradeoff.csv and auto.csv, where runs
add up; docs/research/results/tradeoff.md and docs/research/results/auto.md. Not part of `all`: `snakemake tradeoff` makes it, or `study`. Seconds differ from machine
to machine: one that is otherwise idle is to run all of it.
"""


use rule evaluate_round as evaluate_at with:
    output:
        metrics="<results>/<round>/metrics_{size}.json",
    log:
        "<logs>/<round>/evaluate_at_{size}.log",
    benchmark:
        "<benchmarks>/<round>/evaluate_at_{size}.tsv"
    params:
        quality=lambda wildcards: config["presets"][wildcards.preset] | {"size": int(wildcards.size)},
        t=integer("t"),
        source=code_of("evaluate_field"),


rule gather_tradeoff:
    """What every setting costs, what it is worth, and which of them nothing else beats."""
    input:
        measured=lambda wildcards: files_of(tradeoff_cells()),
    output:
        table="results/tradeoff/tradeoff.csv",
        pareto="results/tradeoff/pareto.csv",
        kept=update("docs/research/data/tradeoff.csv"),
    log:
        "<logs>/tradeoff/gather_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/gather_tradeoff.tsv"
    params:
        cells=lambda wildcards: tradeoff_cells(),
        source=code_of("study/gather_tradeoff"),
    script:
        "../../scripts/study/gather_tradeoff.py"


rule plot_tradeoff:
    """Draw what settings are worth over their time: all of them with their front, and knob by knob."""
    input:
        table=rules.gather_tradeoff.output.table,
        pareto=rules.gather_tradeoff.output.pareto,
    output:
        pareto=report("results/tradeoff/pareto.png", caption="../../workflow/report/tradeoff.rst", category="Trade-off"),
        knobs=report("results/tradeoff/knobs.png", caption="../../workflow/report/tradeoff.rst", category="Trade-off"),
    log:
        "<logs>/tradeoff/plot_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/plot_tradeoff.tsv"
    params:
        source=code_of("study/plot_tradeoff"),
    script:
        "../../scripts/study/plot_tradeoff.py"


rule write_tradeoff:
    """Which settings are worth their time, in words."""
    input:
        table=rules.gather_tradeoff.output.table,
        pareto=rules.gather_tradeoff.output.pareto,
        figures=rules.plot_tradeoff.output,
    output:
        page="docs/research/results/tradeoff.md",
        figures=expand("docs/research/figures/tradeoff_{shown}.png", shown=["pareto", "knobs"]),
    log:
        "<logs>/tradeoff/write_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/write_tradeoff.tsv"
    params:
        source=code_of("study/write_tradeoff"),
    script:
        "../../scripts/study/write_tradeoff.py"


rule gather_auto:
    """What `auto` chose for each scene, what fixed settings cost instead, and what was lost."""
    input:
        measured=lambda wildcards: files_of(auto_cells()),
    output:
        table="results/tradeoff/auto.csv",
        kept=update("docs/research/data/auto.csv"),
        page="docs/research/results/auto.md",
    log:
        "<logs>/tradeoff/gather_auto.log",
    benchmark:
        "<benchmarks>/tradeoff/gather_auto.tsv"
    params:
        cells=lambda wildcards: auto_cells(),
        source=code_of("study/gather_auto"),
    script:
        "../../scripts/study/gather_auto.py"


rule tradeoff:
    """Speed against accuracy: tables, figures and pages."""
    input:
        rules.write_tradeoff.output,
        rules.gather_auto.output,


localrules:
    tradeoff,
