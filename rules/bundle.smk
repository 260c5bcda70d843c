"""Bundle: what a viewer loads. Here tau enters: tiles of higher uncertainty keep more pre-sorted orders.

In: the tiles. Out: davgswt.json (the contract with the viewer, docs/formats.md), its chunks, and gswt.zip for the public
renderer.
"""


rule bundle_tiles:
    """Pack the tiles with their pre-sorted orders."""
    input:
        unpack(photos_of_field),
        unpack(materials_of),
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
        mem_mb=per_attempt(2500),
        runtime=per_attempt("10m"),
    params:
        tau=real("tau"),
        seed=integer("seed"),
        source=code_of("bundle_tiles"),
    script:
        "../scripts/bundle_tiles.py"
