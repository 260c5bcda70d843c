"""Sweeps: the rows of the config's `sweeps`, each one table (a row a cell) and its figure.

In: what its cells left, each a scene, a seed and a combination of settings; a cell is restarted by itself, and what cells
have in common is made once. Out: results/sweeps/{sweep}.csv and {sweep}.png; docs/research/data/sweep_{sweep}.csv, where runs add up.
Not part of `all`: a sweep is asked for by its path, several by `snakemake study`.
"""


rule gather_sweep:
    """Collect what every cell of a sweep measured and what it cost."""
    input:
        measured=lambda wildcards: [path for cell in sweep_cells(wildcards.sweep) for path in cell["files"].values()],
    output:
        table=report(
            "results/sweeps/{sweep}.csv",
            caption="../../workflow/report/sweep.rst",
            category="Sweeps",
            labels={"sweep": "{sweep}", "shown": "table"},
        ),
        kept=update("docs/research/data/sweep_{sweep}.csv"),
    log:
        "<logs>/sweeps/gather_{sweep}.log",
    benchmark:
        "<benchmarks>/sweeps/gather_{sweep}.tsv"
    params:
        cells=lambda wildcards: sweep_cells(wildcards.sweep),
        source=code_of("study/gather_sweep"),
    script:
        "../../scripts/study/gather_sweep.py"


rule plot_sweep:
    """Draw what a sweep measured over what it varied."""
    input:
        table="results/sweeps/{sweep}.csv",
    output:
        plot=report(
            "results/sweeps/{sweep}.png",
            caption="../../workflow/report/sweep.rst",
            category="Sweeps",
            labels={"sweep": "{sweep}", "shown": "figure"},
        ),
    log:
        "<logs>/sweeps/plot_{sweep}.log",
    benchmark:
        "<benchmarks>/sweeps/plot_{sweep}.tsv"
    params:
        axes=lambda wildcards: list(config["sweeps"][wildcards.sweep]["vary"]),
        source=code_of("study/plot_sweep"),
    script:
        "../../scripts/study/plot_sweep.py"
