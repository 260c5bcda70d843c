"""Levels of detail: ever coarser fields of the exemplar, each fitted to what its finer neighbour shows.

In: the last round's field and ground, inpainted or not. Out: levels/ with level{l}.ply and its grid level{l}.exr, from fine to
coarse, and levels.json, which describes them and says why there are no more.
"""


rule make_levels:
    """As many levels as the config wants and the exemplar has room for; tiles add coarser ones of their own."""
    input:
        unpack(maps_of_prior),
        unpack(materials_of),
        field="<results>/<round>{inpainted}/field.ply",
        ground="<results>/<round>{inpainted}/ground.exr",
    output:
        levels=directory("<results>/<levels>"),
    log:
        "<logs>/<levels>/make_levels.log",
    benchmark:
        "<benchmarks>/<levels>/make_levels.tsv"
    threads: 1  # it has little work for a second one
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("30m"),
    params:
        levels=lambda wildcards: config["levels"],
        preset=preset_keys("make_levels"),
        seed=integer("seed"),
        source=code_of("make_levels"),
    script:
        "../scripts/make_levels.py"
