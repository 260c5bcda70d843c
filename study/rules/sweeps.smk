"""Sweeps: what one setting changes; one table and one figure for each row of the config's `study.sweeps`.

In: what its experiments left, each a scene, a seed and a combination of settings; what experiments have in common is made once.
Out: study/results/sweeps/{sweep}.csv and {sweep}.png; study/docs/data/sweep_{sweep}.csv, where runs add up.
"""


rule gather_comparison:
    """Collect what every cell of a sweep measured and what it cost."""
    input:
        measured=lambda wildcards: [
            path for cell in sweep_experiments(wildcards.sweep) for path in cell["files"].values()
        ],
    output:
        table=report(
            "study/results/sweeps/{sweep}.csv",
            caption="../report/sweep.rst",
            category="Sweeps",
            labels={"sweep": "{sweep}", "shown": "table"},
        ),
        kept=update("study/docs/data/sweep_{sweep}.csv"),
    log:
        "<logs>/sweeps/gather_{sweep}.log",
    benchmark:
        "<benchmarks>/sweeps/gather_{sweep}.tsv"
    params:
        cells=lambda wildcards: sweep_experiments(wildcards.sweep),
        source=code_of_study("gather_comparison"),
    script:
        "../scripts/gather_comparison.py"


rule plot_comparison:
    """Draw what a sweep measured over what it varied."""
    input:
        table="study/results/sweeps/{sweep}.csv",
    output:
        plot=report(
            "study/results/sweeps/{sweep}.png",
            caption="../report/sweep.rst",
            category="Sweeps",
            labels={"sweep": "{sweep}", "shown": "figure"},
        ),
    log:
        "<logs>/sweeps/plot_{sweep}.log",
    benchmark:
        "<benchmarks>/sweeps/plot_{sweep}.tsv"
    params:
        axes=lambda wildcards: list(STUDY["sweeps"][wildcards.sweep]["vary"]),
        source=code_of_study("plot_comparison"),
    script:
        "../scripts/plot_comparison.py"
