"""Completion: what no photo saw is painted by a prior, where the config asks for it (`complete`).

In: the last round's field and ground, and its photos. Out: field.ply, in which what is imagined is marked and all else
has its bytes; ground.exr, unchanged, since nothing imagined was seen; completion.json, how much it was; metrics.json,
what the test photos say of the field before and after, which nothing else sees.
"""


rule complete_field:
    """Paint the ground that no photo saw; a field without such ground goes on as it is."""
    input:
        unpack(painter_of),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
        captures=captures_until,
    output:
        field="<results>/<round>/completed_{painter}/field.ply",
        ground="<results>/<round>/completed_{painter}/ground.exr",
        facts="<results>/<round>/completed_{painter}/completion.json",
    log:
        "<logs>/<round>/completed_{painter}/complete_field.log",
    benchmark:
        "<benchmarks>/<round>/completed_{painter}/complete_field.tsv"
    wildcard_constraints:
        policy=CHOOSING,
    threads: 2
    resources:
        mem_mb=growing(3000),
        runtime=growing("30m"),
    params:
        prior=entry("priors", "painter"),
        seed=integer("seed"),
        source=source_of("active/completion", *SCORING),
    script:
        "../scripts/complete_field.py"


rule evaluate_completed:
    """Compare the field before and after with the test photos, everywhere and where it is imagined."""
    input:
        unpack(lpips_if_fetched),
        before="<results>/<round>/field.ply",
        after="<results>/<round>/completed_{painter}/field.ply",
        ground="<results>/<round>/ground.exr",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        metrics="<results>/<round>/completed_{painter}/metrics.json",
    log:
        "<logs>/<round>/completed_{painter}/evaluate_completed.log",
    benchmark:
        "<benchmarks>/<round>/completed_{painter}/evaluate_completed.tsv"
    wildcard_constraints:
        policy=CHOOSING,
    threads: 2
    resources:
        mem_mb=growing(1500),
        runtime=growing("10m"),
    params:
        quality=entry("qualities", "quality"),
        source=source_of("active/completion", "active/evaluation", "metrics", "perceptual", "raster"),
    script:
        "../scripts/evaluate_completed.py"
