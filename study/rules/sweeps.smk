"""Sweeps: what one setting changes; one table and one figure for each row of the config's `study.sweeps`.

In: what its experiments left, each a scene, a seed and a combination of settings; what experiments have in common is made once.
Out: study/results/sweeps/{sweep}.csv and {sweep}.png; study/docs/data/sweep_{sweep}.csv, where runs add up.
"""


rule gather_comparison:
    """Collect and draw what every cell of a sweep measured and what it cost."""
    input:
        measured=lambda wildcards: files_of(sweep_experiments(wildcards.sweep)),
    output:
        table="study/results/sweeps/{sweep}.csv",
        plot="study/results/sweeps/{sweep}.png",
        kept=update("study/docs/data/sweep_{sweep}.csv"),
    log:
        "<logs>/sweeps/gather_{sweep}.log",
    params:
        cells=lambda wildcards: sweep_experiments(wildcards.sweep),
        axes=lambda wildcards: list(STUDY["sweeps"][wildcards.sweep]["vary"]),
        source=code_of_study("gather_comparison"),
    script:
        "../scripts/gather_comparison.py"
