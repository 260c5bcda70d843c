"""View selection: score the candidate poses and choose the next k.

In: the field of round t - 1 and its scores. Out: scores.csv and scores.json, maps.npz, uncertainty.exr of a field; of round t
poses.json. Scores keep their terms apart: the policy, lam and k enter when poses are chosen, so sweeps over
them share the first scoring.
"""


rule score_coarse:
    """Score every candidate pose by what the coarse field does not know there, and freeze the scales of the terms."""
    input:
        unpack(prior_weights),
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
    threads: lambda wildcards: 1 if wildcards.prior == "none" else 2  # a prior works in parallel
    resources:
        mem_mb=lambda wildcards, attempt: (1000 if wildcards.prior == "none" else 3000) * attempt,
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("score_coarse"),
        prior=lambda wildcards: config["priors"].get(wildcards.prior),
        p_drop=real("p_drop"),
        seed=integer("seed"),
        source=code_of("score_poses"),
    script:
        "../scripts/score_poses.py"


use rule score_coarse as score_round with:
    input:
        unpack(prior_weights),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        frozen=lambda wildcards: f"{chosen_folder('scored', wildcards)}/scores.json",
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
    """Choose the k poses that the policy expects most of."""
    input:
        unpack(round_before),
        unpack(pictures_that_tell),
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
    log:
        "<logs>/<round>/select_poses.log",
    benchmark:
        "<benchmarks>/<round>/select_poses.tsv"
    wildcard_constraints:
        preset=FITS_ROUNDS,
        t=POSITIVE,
    params:
        scene=scene_keys("select_poses"),
        policy=lambda wildcards: wildcards.policy,
        lam=real("lam"),
        k=integer("k"),
        seed=integer("seed"),
        t=integer("t"),
        source=code_of("select_poses"),
    script:
        "../scripts/select_poses.py"
