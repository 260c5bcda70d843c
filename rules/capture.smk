"""Capture: the scene's agent takes the photos of the chosen poses.

In: poses.json. Out: capture/, the photos with their cameras. `render` and `replay` take them at once; `serial` drives a
camera rig, `plan` writes a drone mission, `handheld` a shot list: these run on this machine and never take a photo twice.
Where another preset chooses (`choose_with`), its photos are copied with what says why they were chosen.
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
        scene=scenes_by(*(name for name, agent in AGENTS.items() if not agent.device)),
        preset=FITS_ROUNDS,
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
        scene=scenes_by(*(name for name, agent in AGENTS.items() if agent.device)),
        preset=FITS_ROUNDS,
        t=POSITIVE,
    retries: 0  # whatever a profile says: nothing is taken twice


rule copy_chosen_photos:
    """Take over the photos of a round of the preset that chooses them."""
    input:
        poses=lambda wildcards: f"{chosen_round(wildcards, wildcards.t)}/poses.json",
        capture=lambda wildcards: f"{chosen_round(wildcards, wildcards.t)}/capture",
    output:
        poses="<results>/<round>/poses.json",
        capture=directory("<results>/<round>/capture"),
    log:
        "<logs>/<round>/copy_chosen_photos.log",
    benchmark:
        "<benchmarks>/<round>/copy_chosen_photos.tsv"
    wildcard_constraints:
        policy=CHOOSING,
        preset=FITS_ONCE,
        t=POSITIVE,
    params:
        chooser=lambda wildcards: chooser_of(wildcards.preset),
        source=code_of("copy_chosen_photos"),
    script:
        "../scripts/copy_chosen_photos.py"


localrules:
    copy_chosen_photos,  # copies files
    request_views,  # the device, or the folder that people drop photos into, is here
