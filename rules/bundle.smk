"""Bundle: what a viewer loads. Here tau enters: tiles of higher uncertainty are drawn in more orders, which viewers keep. So does variation: how much
large-scale light and dark the ground has.

In: the tiles. Out: davgswt.json (the contract with the viewer, docs/formats.md) and its parts.
"""


rule bundle_tiles:
    """Pack the exemplars and the recipes of the tiles."""
    input:
        unpack(photos_of_field),
        unpack(materials_of),
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        levels="<results>/<levels>",
        frame="<results>/<photos>/ground.json",
    output:
        manifest="<results>/<bundle>/davgswt.json",
        parts=directory("<results>/<bundle>/parts"),
    log:
        "<logs>/<bundle>/bundle_tiles.log",
    benchmark:
        "<benchmarks>/<bundle>/bundle_tiles.tsv"
    threads: 1  # it has little work for a second one
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("10m"),
    params:
        tau=real("tau"),
        variation=lookup(dpath="variation", within=config),
        seed=integer("seed"),
        source=code_of("bundle_tiles"),
    script:
        "../scripts/bundle_tiles.py"
