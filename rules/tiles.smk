"""Wang tiles: a centre, two strips per direction and one corner, joined along cuts that nobody should find.

In: the levels. Out: labels.npz, lod{l}_tile_{TT}.ply and seams.json. The cut is made on the finest level; coarser
levels follow it.
"""


rule cut_tiles:
    """Cut sixteen tiles from the exemplar."""
    input:
        unpack(describing),
        levels="<results>/<levels>",
    output:
        seams="<results>/<tiles>/seams.json",
        tiles=directory("<results>/<tiles>/tiles"),
    log:
        "<logs>/<tiles>/cut_tiles.log",
    benchmark:
        "<benchmarks>/<tiles>/cut_tiles.tsv"
    threads: 2
    resources:
        mem_mb=2000,
        runtime="20m",
    params:
        seam=entry("seams", "seam"),
        seed=integer("seed"),
        source=source_of("tiles", "levels", "raster", "perceptual", "threads", "active/uncertainty"),
    script:
        "../scripts/cut_tiles.py"
