"""Figures of view selection in one experiment.

In: what the rounds 1 to t left. Out: sphere_{t}.png, the candidates of each round by their scores, and those chosen (the
paper's uncertainty sphere); evolution_{t}.png, two test views after the rounds 0, 1 and t, and where their renders are wrong.
"""


rule plot_sphere:
    """Show what each of the rounds 1 to t chose from, and what it chose."""
    input:
        scores=deciding_scores,
        poses=poses_until,
        captures=captures_before,
        views="<results>/<start>/views.json",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        plot=report(
            "<results>/<active>/sphere_{t}.png",
            caption="../report/sphere.rst",
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
        source=code_of_study("plot_sphere"),
    script:
        "../scripts/plot_sphere.py"


rule plot_evolution:
    """Show two test views after the rounds 0, 1 and t, and where their renders are wrong."""
    input:
        fields=in_figure_rounds("field.ply"),
        grounds=in_figure_rounds("ground.exr"),
        metrics=in_figure_rounds("metrics.json"),
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        plot=report(
            "<results>/<active>/evolution_{t}.png",
            caption="../report/evolution.rst",
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
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        size=lambda wildcards: config["presets"][wildcards.preset]["size"],
        titles=lambda wildcards: [f"round {t}" for t in figure_rounds(wildcards)],
        source=code_of_study("plot_evolution"),
    script:
        "../scripts/plot_evolution.py"
