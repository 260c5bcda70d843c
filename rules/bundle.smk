"""Bundle: what a viewer loads. tau enters here: tiles in more doubt than tau keep more pre-sorted orders.

In: the tiles. Out: davgswt.json (the only contract with the viewer), its chunks, and gswt.zip for the public renderer.
Beside the tiles, whatever tau is: lod.csv, how coarse each level is, from where it is used and how well it stands in for
the finest there. `snakemake lod_table` gathers those of the scenes that the config's `lod` names.
"""


rule bundle_tiles:
    """Pack the tiles with their pre-sorted orders."""
    input:
        unpack(photos_behind),
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        levels="<results>/<levels>",
        frame="<results>/<photos>/ground.json",
    output:
        manifest="<results>/<bundle>/davgswt.json",
        chunks=directory("<results>/<bundle>/chunks"),
        archive="<results>/<bundle>/gswt.zip",
    log:
        "<logs>/<bundle>/bundle_tiles.log",
    benchmark:
        "<benchmarks>/<bundle>/bundle_tiles.tsv"
    threads: 2
    resources:
        mem_mb=2500,
        runtime="10m",
    params:
        tau=real("tau"),
        seed=integer("seed"),
        schema=BUNDLE_SCHEMA,
        source=source_of("bundle", "raster"),
    script:
        "../scripts/bundle_tiles.py"


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
        mem_mb=4000,
        runtime="20m",
    params:
        source=source_of("bundle", "tiles/layout", "raster"),
    script:
        "../scripts/measure_levels.py"


rule gather_lod:
    """One table of the levels of all scenes that are named."""
    input:
        tables=lambda wildcards: list(levels_measured()),
    output:
        table="results/tables/lod.csv",
    log:
        "<logs>/tables/gather_lod.log",
    benchmark:
        "<benchmarks>/tables/gather_lod.tsv"
    params:
        cells=lambda wildcards: list(levels_measured().values()),
        source=source_of("figures"),
    script:
        "../scripts/gather_lod.py"


rule lod_table:
    """The table of levels."""
    input:
        rules.gather_lod.output.table,


localrules:
    lod_table,
