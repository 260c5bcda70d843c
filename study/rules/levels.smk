"""Levels and pre-sorted orders against the finest level and exact sorting: `snakemake lod_table orders_table`.

In: tiles. Out: lod.csv and orders.csv beside them; of the scenes of the config's `study.lod` study/results/tables/lod.csv, orders.csv.
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


rule measure_orders:
    """How much a tile's picture errs when it is drawn in a neighbour's order, for ever more directions."""
    input:
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        table="<results>/<tiles>/orders.csv",
    log:
        "<logs>/<tiles>/measure_orders.log",
    benchmark:
        "<benchmarks>/<tiles>/measure_orders.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("20m"),
    params:
        source=code_of_study("measure_orders"),
    script:
        "../scripts/measure_orders.py"


use rule gather_lod as gather_orders with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_orders)),
    output:
        table="study/results/tables/orders.csv",
    log:
        "<logs>/tables/gather_orders.log",
    benchmark:
        "<benchmarks>/tables/gather_orders.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_orders).values()),
        source=code_of_study("gather_lod"),


rule lod_table:
    """The table of levels."""
    input:
        rules.gather_lod.output.table,


rule orders_table:
    """The table of orders."""
    input:
        rules.gather_orders.output.table,


localrules:
    lod_table,
    orders_table,
