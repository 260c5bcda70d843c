"""What active views are worth: figures of the rounds of a cell, that is of a scene, seed, quality and policy.

In: what the rounds 1 to t left. Out: sphere_{t}.png, the candidates of each round by what the scores said of them, and
those it chose (the paper's uncertainty sphere); evolution_{t}.png, two test views after rounds 0, 1 and t, and where
their renders are wrong. Not part of `all`: a figure is asked for by its path.
"""


rule plot_sphere:
    """Show what each of the rounds 1 to t chose from, and what it chose."""
    input:
        scores=scores_that_chose,
        poses=poses_until,
        captures=captures_before,
        views="<results>/<start>/views.json",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        plot=report(
            "<results>/<active>/sphere_{t}.png",
            caption="../../workflow/report/sphere.rst",
            category="View selection",
            labels={"scene": "{scene}", "policy": "{policy}", "k": "{k}", "rounds": "{t}"},
        ),
    log:
        "<logs>/<active>/plot_sphere_{t}.log",
    benchmark:
        "<benchmarks>/<active>/plot_sphere_{t}.tsv"
    wildcard_constraints:
        policy=CHOOSING,
        t=POSITIVE,
    params:
        lam=real("lam"),
        source=code_of("study/plot_sphere"),
    script:
        "../../scripts/study/plot_sphere.py"


rule plot_evolution:
    """Show two test views after the rounds 0, 1 and t, and where their renders are wrong."""
    input:
        fields=lambda wildcards: left_by("field.ply", wildcards),
        grounds=lambda wildcards: left_by("ground.exr", wildcards),
        metrics=lambda wildcards: left_by("metrics.json", wildcards),
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        plot=report(
            "<results>/<active>/evolution_{t}.png",
            caption="../../workflow/report/evolution.rst",
            category="View selection",
            labels={"scene": "{scene}", "policy": "{policy}", "k": "{k}", "rounds": "{t}"},
        ),
    log:
        "<logs>/<active>/plot_evolution_{t}.log",
    benchmark:
        "<benchmarks>/<active>/plot_evolution_{t}.tsv"
    wildcard_constraints:
        policy=CHOOSING,
        t=POSITIVE,
    resources:
        mem_mb=growing(1500),
        runtime=growing("10m"),
    params:
        size=lambda wildcards: config["presets"][wildcards.preset]["size"],
        rounds=shown_rounds,
        source=code_of("study/plot_evolution"),
    script:
        "../../scripts/study/plot_evolution.py"
