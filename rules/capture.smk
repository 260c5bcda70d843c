"""Capture: the scene's agent takes the photos of the chosen poses.

In: poses.json. Out: capture/, the photos with their cameras. `render` and `replay` take them at once; `serial` drives a
camera rig, `plan` writes a drone mission, `handheld` a shot list: these run on this machine and never take a photo twice.
"""


rule capture_views:
    """Have the scene's agent take the photos: at once, where the scene can be rendered or replayed."""
    input:
        poses="<results>/<round>/poses.json",
        views="<results>/<start>/views.json",
        captures=captures_before,
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        capture=directory("<results>/<round>/capture"),
    log:
        "<logs>/<round>/capture_views.log",
    benchmark:
        "<benchmarks>/<round>/capture_views.tsv"
    wildcard_constraints:
        scene=scenes_by("render", "replay"),
        t=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("30m"),
    params:
        scene=scene_keys("capture_views"),
        source=code_of("capture_views"),
    script:
        "../scripts/capture_views.py"


use rule capture_views as request_views with:
    input:
        field=lambda wildcards: round_before(wildcards)["field"],
        poses="<results>/<round>/poses.json",
        views="<results>/<start>/views.json",
        captures=captures_before,
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        lenses="<results>/<photos>/lenses.json",
        frame="<results>/<photos>/ground.json",
        template=str(BASE / "workflow/report/shot_list.html"),
    log:
        "<logs>/<round>/request_views.log",
    benchmark:
        "<benchmarks>/<round>/request_views.tsv"
    wildcard_constraints:
        scene=scenes_by("serial", "plan", "handheld"),
        t=POSITIVE,
    retries: 0  # whatever a profile says: nothing is taken twice


localrules:
    request_views,  # the device, or the folder that people drop photos into, is here
