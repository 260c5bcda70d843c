"""Photos of the study's synthetic scenes: in other layouts than the product's, and with further test views.

In: the config's `study.photographed`. Out: what the product's rule render_photos makes.
"""

PHOTOGRAPHED = {name: asked for asked in STUDY["photographed"].values() for name in asked["scenes"]}


rule render_study_photos:
    """The start and test views of a synthetic scene, from where the study takes them."""
    output:
        images=directory("<results>/<photos>/images"),
        model=directory("<results>/<photos>/sparse"),
        frame="<results>/<photos>/ground.json",
    log:
        "<logs>/<photos>/render_study_photos.log",
    benchmark:
        "<benchmarks>/<photos>/render_study_photos.tsv"
    wildcard_constraints:
        scene="|".join(PHOTOGRAPHED) or NEVER,
    threads: 2
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("render_photos"),
        photographed=lambda wildcards: PHOTOGRAPHED[wildcards.scene],
        source=code_of_study("render_study_photos"),
    script:
        "../scripts/render_study_photos.py"


ruleorder: render_study_photos > render_photos
