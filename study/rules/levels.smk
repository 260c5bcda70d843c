"""Levels against the finest one: `snakemake lod_table`.

In: tiles. Out: lod.csv beside them; of the scenes of the config's `study.lod` study/results/tables/lod.csv.
"""


rule measure_levels:
    """Compare every level of every tile with the finest, at the distance from which the bundle uses it."""
    input:
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        table="<results>/<tiles>/lod.csv",
    log:
        "<logs>/<tiles>/measure_levels.log",
    benchmark:
        "<benchmarks>/<tiles>/measure_levels.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("20m"),
    params:
        source=code_of_study("measure_levels"),
    script:
        "../scripts/measure_levels.py"


rule gather_lod:
    """One table of the levels of all scenes that are named."""
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_levels)),
    output:
        table=report(
            "study/results/tables/lod.csv",
            caption="../report/lod.rst",
            category="Tables",
            labels={"table": "levels of detail"},
        ),
    log:
        "<logs>/tables/gather_lod.log",
    benchmark:
        "<benchmarks>/tables/gather_lod.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_levels).values()),
        source=code_of_study("gather_lod"),
    script:
        "../scripts/gather_lod.py"


rule lod_table:
    """The table of levels."""
    input:
        rules.gather_lod.output.table,
