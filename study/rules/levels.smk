"""Levels against the finest one (`snakemake lod_table`), and what the page's shortcuts do to a picture: pre-sorted orders, levels
and rounding (`snakemake presort_table`).

In: bundles and tiles. Out: lod.csv beside the tiles, presort.csv beside each bundle; of the scenes of the config's `study.lod`
study/results/tables/lod.csv, presort.csv and a figure.
"""


rule measure_levels:
    """Compare every level of every tile with the finest, at the distance from which the bundle uses it."""
    input:
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        levels="<results>/<levels>",
    output:
        table="<results>/<tiles>/lod.csv",
    log:
        "<logs>/<tiles>/measure_levels.log",
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("20m"),
    params:
        source=code_of_study("measure_levels"),
    script:
        "../scripts/measure_levels.py"


rule measure_presort:
    """What pre-sorted orders, levels and rounding do to a picture, against all Gaussians sorted exactly."""
    input:
        unpack(materials_of),
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        levels="<results>/<levels>",
    output:
        table="<results>/<bundle>/presort.csv",
    log:
        "<logs>/<bundle>/measure_presort.log",
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("20m"),
    params:
        seed=integer("seed"),
        source=code_of_study("measure_presort"),
    script:
        "../scripts/measure_presort.py"


def gathered_cells(wildcards):
    """The tables of a table of several scenes: the path of each one's, and what tells it from the others."""
    made, entry = {
        "lod": (rules.measure_levels, "lod"),
        "presort": (rules.measure_presort, "lod"),
        "materials": (rules.measure_materials, "materials"),
        "lattice": (rules.measure_lattice, "lattice"),
    }[wildcards.gathered]
    return measured_of_tiles(made, entry)


rule gather_scenes:
    """A measurement of several scenes as one table."""
    input:
        tables=lambda wildcards: list(gathered_cells(wildcards)),
    output:
        table="study/results/tables/{gathered}.csv",
    log:
        "<logs>/tables/gather_{gathered}.log",
    wildcard_constraints:
        gathered="lod|presort|materials|lattice",
    params:
        cells=lambda wildcards: list(gathered_cells(wildcards).values()),
        source=code_of_study("gather_scenes"),
    script:
        "../scripts/gather_scenes.py"


rule plot_presort:
    """The same as a figure; both are kept in docs, too."""
    input:
        table="study/results/tables/presort.csv",
    output:
        plot="study/results/figures/presort.png",
        kept="study/docs/figures/presort.png",
        data="study/docs/data/presort.csv",
    log:
        "<logs>/figures/plot_presort.log",
    params:
        source=code_of_study("plot_presort"),
    script:
        "../scripts/plot_presort.py"


rule lod_table:
    """The table of levels."""
    input:
        "study/results/tables/lod.csv",


rule presort_table:
    """What the page's shortcuts cost: table and figure."""
    input:
        rules.plot_presort.output,
