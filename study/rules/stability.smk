"""Numerical stability at the extremes: every formula in float32 against float64, and the workflow at the ends of its range.

In: the library; the config of the tests, overridden by each extreme. Out: study/docs/data/stability.csv, a row a formula;
study/results/stability/{extreme}/; study/docs/data/stability_runs.csv, a row a run; the page study/docs/results/stability.md.
`snakemake stability`.
"""

from dav_gswt_study.stability.extremes import EXTREMES


rule measure_formulas:
    """Compare every formula with its float64 reference over its whole range."""
    output:
        table="study/docs/data/stability.csv",
        facts="study/docs/data/stability.json",
    log:
        "<logs>/stability/measure_formulas.log",
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("10m"),
    params:
        source=code_of_study("measure_formulas"),
    script:
        "../scripts/measure_formulas.py"


rule run_extreme:
    """Run the whole workflow at one extreme, in a folder of its own; that it fails is an outcome like any other."""
    input:
        configs=[str(Path(BASE, name)) for name in ("config/config.yaml", "config/test/config.yaml")],
    output:
        folder=directory("study/results/stability/{extreme}"),
    log:
        "<logs>/stability/run_{extreme}.log",
    wildcard_constraints:
        extreme="|".join(map(re.escape, EXTREMES)),
    threads: 2
    resources:
        mem_mb=per_attempt(8000),
        runtime=per_attempt("60m"),
    params:
        root=lambda wildcards: str(BASE),
        lpips=lambda wildcards: config["lpips"],
        source=code_of_study("run_extreme"),
    script:
        "../scripts/run_extreme.py"


rule write_stability:
    """What came of every run, in one table; the page about it and about formulas, and its figure."""
    input:
        formulas=rules.measure_formulas.output.table,
        facts=rules.measure_formulas.output.facts,
        runs=expand(rules.run_extreme.output.folder, extreme=EXTREMES),
        template=str(HERE / "report/stability.md"),
    output:
        page="study/docs/results/stability.md",
        runs="study/docs/data/stability_runs.csv",
        plot="study/docs/figures/stability.png",
    log:
        "<logs>/stability/write_stability.log",
    params:
        source=code_of_study("write_stability"),
    script:
        "../scripts/write_stability.py"


rule stability:
    """How numbers behave at the extremes: a page, a figure, two tables."""
    input:
        rules.write_stability.output,
