"""Active views: score the candidate poses, choose k, capture them, refit, and again.

In: the coarse field. Out, per round t: poses.json and poses.exr, capture/, field.ply, ground.exr, and of that new field
scores.csv and scores.json, maps.npz, uncertainty.exr and metrics.json. Round t starts from round t - 1, so T rounds are
a prefix of T + 1, and T is only which round is asked for. A round after the stop asks for no pose and hands the field on
as it is. Scoring keeps its terms apart: the policy, lam and k enter when poses are chosen.
"""

SCORING = [
    *(f"active/{name}" for name in ("scoring", "fisher", "imagining", "maps", "outside", "reach")),
    *(f"active/{name}" for name in ("candidates", "poses", "scores", "frozen", "uncertainty", "agents/rig")),
    *(f"prior/{name}" for name in ("conditions", "interface", "terrain", "sampler", "dropout", "networks", "weights")),
    *("prior/zero123", "prior/zero123_folder"),
    "raster",
    "coarse/doubt",
    "perceptual",
]
CHOICE = [
    *(f"active/{name}" for name in ("selection", "policies", "greedy", "facility", "fisher", "needs", "candidates")),
    *(f"active/{name}" for name in ("stopping", "worth", "poses", "scores", "maps", "uncertainty", "calibration")),
    "raster",
    "coarse/doubt",
]


rule score_coarse:
    """Score every candidate pose by what the coarse field does not know there, and freeze the scales of the terms."""
    input:
        unpack(prior_of),
        field="<results>/<coarse>/field.ply",
        ground="<results>/<coarse>/ground.exr",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        scores="<results>/<scored>/scores.csv",
        facts="<results>/<scored>/scores.json",
        maps="<results>/<scored>/maps.npz",
        shown="<results>/<scored>/uncertainty.exr",
    log:
        "<logs>/<scored>/score_coarse.log",
    benchmark:
        "<benchmarks>/<scored>/score_coarse.tsv"
    threads: 2
    resources:
        mem_mb=lambda wildcards, attempt: (1000 if wildcards.prior == "none" else 3000) * attempt,
        runtime=growing("60m"),
    params:
        scene=entry("scenes", "scene"),
        prior=lambda wildcards: config["priors"].get(wildcards.prior),
        p_drop=real("p_drop"),
        seed=integer("seed"),
        source=source_of(*SCORING),
    script:
        "../scripts/score_poses.py"


use rule score_coarse as score_round with:
    input:
        unpack(prior_of),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        frozen="<results>/<scored>/scores.json",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
        captures=captures_until,
    output:
        scores="<results>/<round>/scores.csv",
        facts="<results>/<round>/scores.json",
        maps="<results>/<round>/maps.npz",
        shown="<results>/<round>/uncertainty.exr",
    log:
        "<logs>/<round>/score_round.log",
    benchmark:
        "<benchmarks>/<round>/score_round.tsv"
    wildcard_constraints:
        t=POSITIVE,


rule select_poses:
    """Choose the k poses that the policy expects most of, or none after a stop, and show what is not known there."""
    input:
        unpack(before_round),
        unpack(decided_before),
        unpack(truth_for_oracle),
        captures=captures_before,
        views="<results>/<start>/views.json",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        poses=report(
            "<results>/<round>/poses.json",
            caption="../workflow/report/poses.rst",
            category="View selection",
            labels={"scene": "{scene}", "policy": "{policy}", "k": "{k}", "round": "{t}"},
        ),
        shown="<results>/<round>/poses.exr",
    log:
        "<logs>/<round>/select_poses.log",
    benchmark:
        "<benchmarks>/<round>/select_poses.tsv"
    wildcard_constraints:
        t=POSITIVE,
    params:
        scene=entry("scenes", "scene"),
        size=lambda wildcards: config["qualities"][wildcards.quality]["size"],
        policy=lambda wildcards: wildcards.policy,
        lam=real("lam"),
        k=integer("k"),
        stop=lambda wildcards: read_stop(wildcards.stop),
        seed=integer("seed"),
        t=integer("t"),
        source=source_of(*CHOICE),
    script:
        "../scripts/select_poses.py"


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
        mem_mb=growing(2500),
        runtime=growing("30m"),
    params:
        scene=entry("scenes", "scene"),
        source=source_of("active/agents", "active/candidates", "photos"),
    script:
        "../scripts/capture_views.py"


use rule capture_views as ask_for_views with:
    input:
        field=lambda wildcards: before_round(wildcards)["field"],
        poses="<results>/<round>/poses.json",
        views="<results>/<start>/views.json",
        captures=captures_before,
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        lenses="<results>/<photos>/lenses.json",
        frame="<results>/<photos>/ground.json",
    log:
        "<logs>/<round>/ask_for_views.log",
    benchmark:
        "<benchmarks>/<round>/ask_for_views.tsv"
    wildcard_constraints:
        scene=scenes_by("serial", "plan", "handheld"),
        t=POSITIVE,
    retries: 0  # whatever a profile says: nothing is taken twice


localrules:
    ask_for_views,  # the device, or the folder that people drop photos into, is here


rule update_field:
    """Refit the field with the photos of this round; without any it goes on as it is."""
    input:
        unpack(before_round),
        unpack(fits_before),
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
        t=POSITIVE,
    threads: 2
    resources:
        mem_mb=growing(2000),
        runtime=growing("60m"),
    params:
        quality=entry("qualities", "quality"),
        seed=integer("seed"),
        t=integer("t"),
        keep=SNAPSHOTS,
        source=source_of("coarse", "fitting", "raster"),
    script:
        "../scripts/update_field.py"


use rule evaluate_coarse as evaluate_round with:
    input:
        unpack(lpips_if_fetched),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        fit="<results>/<round>/fit.json",
        poses="<results>/<round>/poses.json",
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
        t=POSITIVE,
    params:
        quality=entry("qualities", "quality"),
        t=integer("t"),
        source=source_of("metrics", "active/evaluation", "active/stopping", "perceptual", "raster"),


rule show_candidates:
    """Draw what some candidates truly show, as small as they are scored: for those who judge scores, never for scores."""
    input:
        frame="<results>/<photos>/ground.json",
    output:
        truth=directory("<results>/<photos>/candidates"),
    log:
        "<logs>/<photos>/show_candidates.log",
    benchmark:
        "<benchmarks>/<photos>/show_candidates.tsv"
    wildcard_constraints:
        scene=scenes_by("render"),
    threads: 2
    resources:
        mem_mb=growing(2500),
        runtime=growing("60m"),
    params:
        scene=entry("scenes", "scene"),
        poses=lookup(dpath="calibration/poses", within=config),
        source=source_of("active/candidates", "active/poses", "active/calibration/truth", "photos"),
    script:
        "../scripts/show_candidates.py"


rule calibrate_coarse:
    """Compare the scores of some candidates with the true error of the field there."""
    input:
        unpack(prior_of),
        unpack(regressors_of),
        unpack(truth_of),
        field="<results>/<coarse>/field.ply",
        ground="<results>/<coarse>/ground.exr",
        scores="<results>/<scored>/scores.csv",
        maps="<results>/<scored>/maps.npz",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        found="<results>/<scored>/calibration.json",
        poses="<results>/<scored>/calibration.csv",
    log:
        "<logs>/<scored>/calibrate_coarse.log",
    benchmark:
        "<benchmarks>/<scored>/calibrate_coarse.tsv"
    threads: 2
    resources:
        mem_mb=growing(3000),
        runtime=growing("60m"),
    params:
        scene=entry("scenes", "scene"),
        size=lambda wildcards: config["qualities"][wildcards.quality]["size"],
        prior=lambda wildcards: config["priors"].get(wildcards.prior),
        p_drop=real("p_drop"),
        lam=lookup(dpath="lam", within=config),
        seed=integer("seed"),
        poses=lookup(dpath="calibration/poses", within=config),
        source=source_of("active", "raster", "prior", "perceptual", "metrics"),
    script:
        "../scripts/calibrate_scores.py"


use rule calibrate_coarse as calibrate_round with:
    input:
        unpack(prior_of),
        unpack(regressors_of),
        unpack(truth_of),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        scores="<results>/<round>/scores.csv",
        maps="<results>/<round>/maps.npz",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
        captures=captures_until,
    output:
        found="<results>/<round>/calibration.json",
        poses="<results>/<round>/calibration.csv",
    log:
        "<logs>/<round>/calibrate_round.log",
    benchmark:
        "<benchmarks>/<round>/calibrate_round.tsv"
    wildcard_constraints:
        t=POSITIVE,


rule begin_active:
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
        "<logs>/<active>/iter0/begin_active.log",
    benchmark:
        "<benchmarks>/<active>/iter0/begin_active.tsv"
    wildcard_constraints:
        policy=CHOOSING,
    script:
        "../scripts/begin_active.py"


localrules:
    begin_active,  # copies three files


rule enter_field:
    """A finished field enters here: its exemplar's surface is found, no photo is needed."""
    input:
        field="<results>/<photos>/field.ply",
        frame="<results>/<photos>/ground.json",
    output:
        field="<results>/<fit>/active_given_none_pdrop0_lam0_k0/iter0/field.ply",
        ground="<results>/<fit>/active_given_none_pdrop0_lam0_k0/iter0/ground.exr",
    log:
        "<logs>/<fit>/active_given_none_pdrop0_lam0_k0/iter0/enter_field.log",
    benchmark:
        "<benchmarks>/<fit>/active_given_none_pdrop0_lam0_k0/iter0/enter_field.tsv"
    threads: 2
    params:
        quality=entry("qualities", "quality"),
        source=source_of("active/given", "coarse", "raster"),
    script:
        "../scripts/enter_field.py"
