"""Wang tiles: a centre, two strips per direction and one corner, joined along cuts.

In: the levels. Out: tiles/labels.npz (which patch each cell shows, and its correction) and seams.json. The cut is made on the finest
level; coarser levels follow it. exports/tiles of a bundle has the tiles themselves.
"""


rule cut_tiles:
    """Cut sixteen tiles from the exemplar."""
    input:
        unpack(lambda wildcards: tiling_inputs(wildcards.tiling)),
        unpack(materials_of),
        levels="<results>/<levels>",
    output:
        seams="<results>/<tiles>/seams.json",
        tiles=directory("<results>/<tiles>/tiles"),
    log:
        "<logs>/<tiles>/cut_tiles.log",
    benchmark:
        "<benchmarks>/<tiles>/cut_tiles.tsv"
    wildcard_constraints:
        tiling=PLAIN_TILING,
    threads: 1  # it has little work for a second one
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("20m"),
    params:
        tiling=entry("tilings", "tiling"),
        seed=integer("seed"),
        source=code_of("cut_tiles"),
    script:
        "../scripts/cut_tiles.py"
