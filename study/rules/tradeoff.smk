"""Speed against accuracy: each setting of the config's `study.tradeoff` turned by itself.

In: what each experiment left, and its jobs' benchmarks. Out: study/results/tradeoff/{tradeoff,pareto}.csv, {pareto,knobs}.png;
study/docs/data/tradeoff.csv, where runs add up; study/docs/results/tradeoff.md. Seconds differ from machine to machine:
one that is otherwise idle is to run all of it. `snakemake tradeoff`.
"""


rule evaluate_at:
    """Compare a round's field with the test photos at another size than it was fitted at."""
    input:
        unpack(lpips_weights),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        fit="<results>/<round>/fit.json",
        poses="<results>/<round>/poses.json",
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        metrics="<results>/<round>/metrics_{size}.json",
    log:
        "<logs>/<round>/evaluate_at_{size}.log",
    benchmark:
        "<benchmarks>/<round>/evaluate_at_{size}.tsv"
    wildcard_constraints:
        t=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        preset=lambda wildcards: preset_keys("evaluate_round")(wildcards) | {"size": int(wildcards.size)},
        t=integer("t"),
        source=code_of("evaluate_field"),
    script:
        "../../scripts/evaluate_field.py"


rule gather_tradeoff:
    """What every setting costs, what it is worth, and which of them nothing else beats."""
    input:
        measured=lambda wildcards: files_of(tradeoff_experiments()),
    output:
        table="study/results/tradeoff/tradeoff.csv",
        pareto="study/results/tradeoff/pareto.csv",
        kept=update("study/docs/data/tradeoff.csv"),
    log:
        "<logs>/tradeoff/gather_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/gather_tradeoff.tsv"
    params:
        cells=lambda wildcards: tradeoff_experiments(),
        source=code_of_study("gather_tradeoff"),
    script:
        "../scripts/gather_tradeoff.py"


rule plot_tradeoff:
    """Draw what settings are worth over their time: all of them with their front, and knob by knob."""
    input:
        table=rules.gather_tradeoff.output.table,
        pareto=rules.gather_tradeoff.output.pareto,
    output:
        pareto=report("study/results/tradeoff/pareto.png", caption="../report/tradeoff.rst", category="Trade-off"),
        knobs=report("study/results/tradeoff/knobs.png", caption="../report/tradeoff.rst", category="Trade-off"),
    log:
        "<logs>/tradeoff/plot_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/plot_tradeoff.tsv"
    params:
        source=code_of_study("plot_tradeoff"),
    script:
        "../scripts/plot_tradeoff.py"


rule write_tradeoff:
    """Which settings are worth their time, in words."""
    input:
        table=rules.gather_tradeoff.output.table,
        pareto=rules.gather_tradeoff.output.pareto,
        figures=rules.plot_tradeoff.output,
    output:
        page="study/docs/results/tradeoff.md",
        figures=expand("study/docs/figures/tradeoff_{shown}.png", shown=["pareto", "knobs"]),
    log:
        "<logs>/tradeoff/write_tradeoff.log",
    benchmark:
        "<benchmarks>/tradeoff/write_tradeoff.tsv"
    params:
        source=code_of_study("write_tradeoff"),
    script:
        "../scripts/write_tradeoff.py"


rule tradeoff:
    """Speed against accuracy: tables, figures and pages."""
    input:
        rules.write_tradeoff.output,


localrules:
    tradeoff,
