"""What the page's shortcuts do to a picture: pre-sorted orders, levels and rounding. `snakemake presort_table`.

In: bundles and tiles. Out: presort.csv beside each bundle; study/results/tables/presort.csv and its figure.
"""


rule measure_presort:
    """What pre-sorted orders, levels and rounding do to a picture, against all Gaussians sorted exactly."""
    input:
        unpack(materials_of),
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
    output:
        table="<results>/<bundle>/presort.csv",
    log:
        "<logs>/<bundle>/measure_presort.log",
    benchmark:
        "<benchmarks>/<bundle>/measure_presort.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("20m"),
    params:
        seed=integer("seed"),
        source=code_of_study("measure_presort"),
    script:
        "../scripts/measure_presort.py"


use rule gather_lod as gather_presort with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_presort)),
    output:
        table="study/results/tables/presort.csv",
    log:
        "<logs>/tables/gather_presort.log",
    benchmark:
        "<benchmarks>/tables/gather_presort.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_presort).values()),
        source=code_of_study("gather_lod"),


rule plot_presort:
    """The same as a figure; both are kept in docs, too."""
    input:
        table=rules.gather_presort.output.table,
    output:
        plot="study/results/figures/presort.png",
        kept="study/docs/figures/presort.png",
        data="study/docs/data/presort.csv",
    log:
        "<logs>/figures/plot_presort.log",
    benchmark:
        "<benchmarks>/figures/plot_presort.tsv"
    params:
        source=code_of_study("plot_presort"),
    script:
        "../scripts/plot_presort.py"


rule presort_table:
    """What the page's shortcuts cost: table and figure."""
    input:
        rules.gather_presort.output.table,
        rules.plot_presort.output.plot,


localrules:
    presort_table,
