"""Coarse field: a ground layer through the start views' points and the things on it, fitted to the start views.

In: photos, their model, views.json. Out: field.ply (standard 3DGS), ground.exr (height, seen or not), fit.json
(what the fit chose and why), metrics.json.
"""


rule fit_coarse:
    """Fit the coarse field to the start views."""
    input:
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        field="<results>/<coarse>/field.ply",
        ground="<results>/<coarse>/ground.exr",
        fit="<results>/<coarse>/fit.json",
    log:
        "<logs>/<coarse>/fit_coarse.log",
    benchmark:
        "<benchmarks>/<coarse>/fit_coarse.tsv"
    threads: 2
    resources:
        mem_mb=growing(2000),
        runtime=growing("60m"),
    params:
        quality=entry("qualities", "quality"),
        seed=integer("seed"),
        whole=lambda wildcards: config["scenes"][wildcards.scene].get("whole", False),
        keep=SNAPSHOTS,
        source=source_of("coarse", "fitting", "raster"),
    script:
        "../scripts/fit_coarse.py"


rule evaluate_coarse:
    """Compare the coarse field with the test photos, which nothing else sees."""
    input:
        unpack(lpips_if_fetched),
        field="<results>/<coarse>/field.ply",
        ground="<results>/<coarse>/ground.exr",
        fit="<results>/<coarse>/fit.json",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        metrics="<results>/<coarse>/metrics.json",
    log:
        "<logs>/<coarse>/evaluate_coarse.log",
    benchmark:
        "<benchmarks>/<coarse>/evaluate_coarse.tsv"
    threads: 2
    resources:
        mem_mb=growing(1500),
        runtime=growing("10m"),
    params:
        quality=entry("qualities", "quality"),
        t=0,
        source=source_of("metrics", "active/evaluation", "perceptual", "raster"),
    script:
        "../scripts/evaluate_field.py"
