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
        source=code_of("bundle_tiles"),
    script:
        "../scripts/bundle_tiles.py"
