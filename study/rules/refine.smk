"""Refinement of cuts: pictures of the cuts are repaired by a prior, and the Gaussians beside them refitted within bounds.

In: tiles and levels. Out: tiles_{tiling}-refined/, the same files again. It was not shown to help (study/docs/lab-notes.md).
"""


rule refine_tiles:
    """Repair pictures of the cuts by a prior, and refit the Gaussians beside them, within bounds."""
    input:
        unpack(refining_prior),
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        levels="<results>/<levels>",
    output:
        seams="<results>/<tiles>-refined/seams.json",
        tiles=directory("<results>/<tiles>-refined/tiles"),
    log:
        "<logs>/<tiles>-refined/refine_tiles.log",
    benchmark:
        "<benchmarks>/<tiles>-refined/refine_tiles.tsv"
    wildcard_constraints:
        tiling=PLAIN_TILING,
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("30m"),
    params:
        refine=STUDY["refine"],
        prior=lambda wildcards: config["priors"][STUDY["refine"]["prior"]],
        seed=integer("seed"),
        source=code_of_study("refine_tiles"),
    script:
        "../scripts/refine_tiles.py"
