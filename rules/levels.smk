"""Levels of detail: ever coarser fields of the exemplar, each fitted to what its finer neighbour shows.

In: the last round's field and ground, completed or not. Out: level{l}.ply and its grid level{l}.exr, from fine to coarse.
"""


rule crop_level:
    """The finest level: the field's exemplar and a margin, in whole blocks of the coarsest level's cells."""
    input:
        unpack(maps_of_round),
        field="<results>/<round>{completed}/field.ply",
        ground="<results>/<round>{completed}/ground.exr",
    output:
        field="<results>/<levels>/level0.ply",
        ground="<results>/<levels>/level0.exr",
    log:
        "<logs>/<levels>/crop_level.log",
    benchmark:
        "<benchmarks>/<levels>/crop_level.tsv"
    params:
        levels=lookup(dpath="levels", within=config),
        source=source_of("levels", "active/maps"),
    script:
        "../scripts/crop_level.py"


rule fit_level:
    """A level with half the resolution and about a quarter of the Gaussians of its finer neighbour."""
    input:
        field=lambda wildcards: f"<results>/<levels>/level{int(wildcards.level) - 1}.ply",
        ground=lambda wildcards: f"<results>/<levels>/level{int(wildcards.level) - 1}.exr",
    output:
        field="<results>/<levels>/level{level}.ply",
        ground="<results>/<levels>/level{level}.exr",
    log:
        "<logs>/<levels>/fit_level{level}.log",
    benchmark:
        "<benchmarks>/<levels>/fit_level{level}.tsv"
    wildcard_constraints:
        level=POSITIVE,
    threads: 2
    resources:
        mem_mb=2000,
        runtime="30m",
    params:
        quality=entry("qualities", "quality"),
        seed=integer("seed"),
        level=integer("level"),
        keep=SNAPSHOTS,
        source=source_of("levels", "coarse", "fitting", "raster"),
    script:
        "../scripts/fit_level.py"
