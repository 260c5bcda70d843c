"""Figures of view selection in one experiment.

In: what the rounds 1 to t left. Out: sphere_{t}.png, the candidates of each round by their scores, and those chosen (the
paper's uncertainty sphere); evolution_{t}.png, two test views after the rounds 0, 1 and t, and where their renders are wrong.
"""

def deciding_scores(wildcards):
    """The scores that rounds 1 to t chose by: those that the round before left."""
    return ["<results>/<scored>/scores.csv", *(f"{round_folder(t)}/scores.csv" for t in range(1, int(wildcards.t)))]


def poses_until(wildcards):
    """The poses that rounds 1 to t chose."""
    return [f"{round_folder(t)}/poses.json" for t in range(1, int(wildcards.t) + 1)]


def figure_rounds(wildcards):
    """The rounds of the evolution figure: none, the first, and round t."""
    return sorted({0, 1, int(wildcards.t)})


def in_figure_rounds(file):
    """An input function: a file as each round of the evolution figure left it."""
    return lambda wildcards: [f"{round_folder(t)}/{file}" for t in figure_rounds(wildcards)]


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
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        size=lambda wildcards: config["presets"][wildcards.preset]["size"],
        rounds=figure_rounds,
        source=code_of("study/plot_evolution"),
    script:
        "../../scripts/study/plot_evolution.py"
