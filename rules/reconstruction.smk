"""Reconstruction: a ground layer and the objects on it, fitted to the photos; refitted in each round of view selection.

In: photos, their model, views.json; of round t the photos captured so far. Out: field.ply (standard 3DGS), ground.exr
(height, seen or not), fit.json (its steps and Gaussians), metrics.json (the test photos, which nothing else sees).
Round t starts from round t - 1, so T is only which round is asked for. With `choose_with` in the preset its rounds are
another preset's, and fit_windows fits all of their photos at once, in the windows of the ground that tiles are cut from;
fit_chosen_photos does so on all the ground (`exemplar: whole`).
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
        mem_mb=per_attempt(2000),
        runtime=per_attempt("60m"),
    params:
        preset=preset_keys("fit_coarse"),
        seed=integer("seed"),
        scene=scene_keys("fit_coarse"),
        keep=SNAPSHOTS,
        source=code_of("fit_coarse"),
    script:
        "../scripts/fit_coarse.py"


rule evaluate_coarse:
    """Compare the coarse field with the test photos, which nothing else sees."""
    input:
        unpack(lpips_weights),
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
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        preset=preset_keys("evaluate_coarse"),
        t=0,
        source=code_of("evaluate_field"),
    script:
        "../scripts/evaluate_field.py"


rule update_field:
    """Refit the field with the photos of this round, or fit all photos anew; without any it goes on as it is."""
    input:
        unpack(round_before),
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        fit="<results>/<round>/fit.json",
    log:
        "<logs>/<round>/update_field.log",
    benchmark:
        "<benchmarks>/<round>/update_field.tsv"
    wildcard_constraints:
        policy=CHOOSING,
        preset=FITS_ROUNDS,
        t=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("update_field"),
        preset=preset_keys("update_field"),
        seed=integer("seed"),
        t=integer("t"),
        keep=SNAPSHOTS,
        source=code_of("update_field"),
    script:
        "../scripts/update_field.py"


rule fit_chosen_photos:
    """Fit the field to the photos that another preset's rounds chose, all at once."""
    input:
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        fit="<results>/<round>/fit.json",
    log:
        "<logs>/<round>/fit_chosen_photos.log",
    benchmark:
        "<benchmarks>/<round>/fit_chosen_photos.tsv"
    wildcard_constraints:
        scene=NOT_WINDOWED,
        policy=CHOOSING,
        preset=FITS_ONCE,
        t=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("fit_chosen_photos"),
        preset=preset_keys("fit_chosen_photos"),
        seed=integer("seed"),
        t=integer("t"),
        keep=SNAPSHOTS,
        source=code_of("fit_chosen_photos"),
    script:
        "../scripts/fit_chosen_photos.py"


rule fit_windows:
    """Fit the windows of the ground that tiles and objects are cut from, at the photos' own resolution."""
    input:
        unpack(draft_of_windows),
        unpack(masks_of_materials),
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        windows=directory("<results>/<round>/windows"),
        fit="<results>/<round>/fit.json",
    log:
        "<logs>/<round>/fit_windows.log",
    benchmark:
        "<benchmarks>/<round>/fit_windows.tsv"
    wildcard_constraints:
        scene=WINDOWED,
        policy=CHOOSING,
        preset=FITS_ONCE,
    threads: 2
    resources:
        mem_mb=per_attempt(2000),
        runtime=per_attempt("60m"),
    params:
        preset=preset_keys("fit_windows"),
        seed=integer("seed"),
        t=integer("t"),
        keep=SNAPSHOTS,
        source=code_of("fit_windows"),
    script:
        "../scripts/fit_windows.py"


use rule evaluate_coarse as evaluate_round with:
    input:
        unpack(lpips_weights),
        unpack(windows_of_round),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        fit="<results>/<round>/fit.json",
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        metrics="<results>/<round>/metrics.json",
    log:
        "<logs>/<round>/evaluate_round.log",
    benchmark:
        "<benchmarks>/<round>/evaluate_round.tsv"
    wildcard_constraints:
        scene=rf"{WINDOWED}|{paths.NAME}(?=/.*/iter[1-9])",  # round 0 of others is a copy
    params:
        preset=preset_keys("evaluate_round"),
        t=integer("t"),
        source=code_of("evaluate_field"),


rule copy_coarse_field:
    """Round 0: no photo was asked for, the coarse field goes on as it is."""
    input:
        field="<results>/<coarse>/field.ply",
        ground="<results>/<coarse>/ground.exr",
        metrics="<results>/<coarse>/metrics.json",
    output:
        field="<results>/<active>/iter0/field.ply",
        ground="<results>/<active>/iter0/ground.exr",
        metrics="<results>/<active>/iter0/metrics.json",
    log:
        "<logs>/<active>/iter0/copy_coarse_field.log",
    benchmark:
        "<benchmarks>/<active>/iter0/copy_coarse_field.tsv"
    wildcard_constraints:
        scene=NOT_WINDOWED,
        policy=CHOOSING,
    script:
        "../scripts/copy_coarse_field.py"


localrules:
    copy_coarse_field,  # copies three files


rule prepare_external_field:
    """A finished field enters here: its exemplar's surface is found, no photo is needed."""
    input:
        field="<results>/<photos>/field.ply",
        frame="<results>/<photos>/ground.json",
    output:
        field="<results>/<external>/field.ply",
        ground="<results>/<external>/ground.exr",
    log:
        "<logs>/<external>/prepare_external_field.log",
    benchmark:
        "<benchmarks>/<external>/prepare_external_field.tsv"
    threads: 2
    params:
        preset=preset_keys("prepare_external_field"),
        source=code_of("prepare_external_field"),
    script:
        "../scripts/prepare_external_field.py"
