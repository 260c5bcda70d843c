"""Calibration: do scores of candidate poses say where a field is wrong?

In: a field, its scores, and what some candidates truly show. Out: calibration.json and calibration.csv of a round;
study/docs/data/calibration.csv and figures/calibration.png of all that the config's `study.calibration` names:
`snakemake calibration`.
"""


rule calibrate_coarse:
    """Compare the scores of some candidates with the true error of the field there."""
    input:
        field="<results>/<coarse>/field.ply",
        ground="<results>/<coarse>/ground.exr",
        scores="<results>/<scored>/scores.csv",
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        found="<results>/<scored>/calibration.json",
        poses="<results>/<scored>/calibration.csv",
    log:
        "<logs>/<scored>/calibrate_coarse.log",
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("60m"),
    params:
        scene=scene_keys("select_poses"),
        size=lambda wildcards: config["presets"][wildcards.preset]["fit_size"],
        lam=lookup(dpath="lam", within=config),
        seed=integer("seed"),
        poses=40,  # spread over all candidates
        source=code_of_study("calibrate_scores"),
    script:
        "../scripts/calibrate_scores.py"


use rule calibrate_coarse as calibrate_round with:
    input:
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        scores="<results>/<round>/scores.csv",
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
    wildcard_constraints:
        t=POSITIVE,


rule plot_calibration:
    """Do scores say where a field is wrong? All scenes and rounds in one table and one figure."""
    input:
        cells=lambda wildcards: list(calibrations()),
    output:
        table="study/docs/data/calibration.csv",
        facts="study/docs/data/calibration.json",
        plot="study/docs/figures/calibration.png",
    log:
        "<logs>/figures/plot_calibration.log",
    params:
        cells=lambda wildcards: list(calibrations().values()),
        source=code_of_study("plot_calibration"),
    script:
        "../scripts/plot_calibration.py"


rule calibration:
    """Compare scores with what is true, in every round of the config's `study.calibration`."""
    input:
        rules.plot_calibration.output,


localrules:
    calibration,
