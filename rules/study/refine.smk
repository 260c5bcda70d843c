"""TODO."""


rule refine_tiles:
    """Repair pictures of the cuts by a prior, and refit the Gaussians beside them, within bounds."""
    input:
        unpack(refiner_of),
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
        seam=CUT,
    threads: 2
    resources:
        mem_mb=growing(3000),
        runtime=growing("30m"),
    params:
        refine=refining,
        prior=lambda wildcards: config["priors"][refining(wildcards)["prior"]],
        seed=integer("seed"),
        source=code_of("study/refine_tiles"),
    script:
        "../../scripts/study/refine_tiles.py"
