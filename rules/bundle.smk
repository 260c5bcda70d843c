"""Bundle: what a viewer loads. tau enters here: tiles in more doubt than tau keep more pre-sorted orders.

In: the tiles. Out: davgswt.json (the only contract with the viewer), its chunks, and gswt.zip for the public renderer.
exports/ply, exports/spz and exports/sog, only where asked for: a patch of terrain at each level for other viewers.
Beside the tiles, whatever tau is: orders.csv, what more directions are worth; lod.csv, how coarse each level is, from
where it is used and how well it stands in for the finest there. `snakemake lod_table orders_table` gathers those of
the scenes that the config's `lod` names.
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
        mem_mb=growing(2500),
        runtime=growing("10m"),
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
        mem_mb=growing(4000),
        runtime=growing("20m"),
    params:
        source=source_of("bundle", "tiles/layout", "raster"),
    script:
        "../scripts/measure_levels.py"


rule gather_lod:
    """One table of the levels of all scenes that are named."""
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_levels)),
    output:
        table=report(
            "results/tables/lod.csv",
            caption="../workflow/report/lod.rst",
            category="Tables",
            labels={"table": "levels of detail"},
        ),
    log:
        "<logs>/tables/gather_lod.log",
    benchmark:
        "<benchmarks>/tables/gather_lod.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_levels).values()),
        source=source_of("figures"),
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
        mem_mb=growing(2000),
        runtime=growing("20m"),
    params:
        source=source_of("bundle", "raster"),
    script:
        "../scripts/measure_orders.py"


use rule gather_lod as gather_orders with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_orders)),
    output:
        table="results/tables/orders.csv",
    log:
        "<logs>/tables/gather_orders.log",
    benchmark:
        "<benchmarks>/tables/gather_orders.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_orders).values()),
        source=source_of("figures"),


rule export_plys:
    """A patch of terrain at each level as a PLY that any viewer of splats opens."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        archive="<results>/<bundle>/gswt.zip",
    output:
        plys=directory("<results>/<bundle>/exports/ply"),
    log:
        "<logs>/<bundle>/export_plys.log",
    benchmark:
        "<benchmarks>/<bundle>/export_plys.tsv"
    resources:
        mem_mb=growing(2500),
        runtime=growing("10m"),
    params:
        schema=BUNDLE_SCHEMA,
        source=source_of("bundle"),
    script:
        "../scripts/export_plys.py"


rule convert_plys:
    """The same patches as SPZ, or as SOG whose levels are streamed, by splat-transform: needs Node.js and the network."""
    input:
        plys="<results>/<bundle>/exports/ply",
    output:
        splats=directory("<results>/<bundle>/exports/{kind}"),
    log:
        "<logs>/<bundle>/convert_plys_{kind}.log",
    benchmark:
        "<benchmarks>/<bundle>/convert_plys_{kind}.tsv"
    resources:
        mem_mb=growing(2500),
        runtime=growing("20m"),
    params:
        source=source_of("bundle/exports"),
    script:
        "../scripts/convert_plys.py"


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
