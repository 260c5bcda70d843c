"""Wang tiles: a centre, two strips per direction and one corner, joined along cuts that nobody should find.

In: the levels. Out: labels.npz, lod{l}_tile_{TT}.ply and seams.json. The cut is made on the finest level; coarser
levels follow it. Where the config asks for it (`refine`), a prior repairs what lies beside the cuts: the same files again,
in tiles_{seam}-refined.
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
    wildcard_constraints:
        seam=CUT,
    threads: 2
    resources:
        mem_mb=growing(2000),
        runtime=growing("20m"),
    params:
        seam=cutting,
        seed=integer("seed"),
        source=code_of("cut_tiles"),
    script:
        "../scripts/cut_tiles.py"
