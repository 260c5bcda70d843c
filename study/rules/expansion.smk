"""Alpha-expansion: all patches of a tile moved against one another at once, as the paper has it, instead of exact cuts.

In: the levels. Out: tiles_{tiling}-expansion/. It was not shown to help (study/docs/results/seams.md).
"""


rule cut_tiles_by_expansion:
    """Cut sixteen tiles; alpha-expansion moves the exact cuts."""
    input:
        unpack(lambda wildcards: tiling_inputs(wildcards.tiling)),
        levels="<results>/<levels>",
    output:
        seams="<results>/<tiles>-expansion/seams.json",
        tiles=directory("<results>/<tiles>-expansion/tiles"),
    log:
        "<logs>/<tiles>-expansion/cut_tiles_by_expansion.log",
    benchmark:
        "<benchmarks>/<tiles>-expansion/cut_tiles_by_expansion.tsv"
    wildcard_constraints:
        tiling=PLAIN_TILING,
    threads: 2
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("20m"),
    params:
        tiling=lambda wildcards: config["tilings"][wildcards.tiling] | {"energy": "expansion"},
        seed=integer("seed"),
        source=code_of_study("cut_tiles_by_expansion"),
    script:
        "../scripts/cut_tiles_by_expansion.py"
