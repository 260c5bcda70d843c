"""Which views are worth taking? Policies compared photo by photo, and figures of the choices of one experiment.

In: the experiments of the config's `study.view_benchmark`, each a scene, a seed, a policy and k. Out: study/docs/data/{table}_curves.csv, a
row for each round of an experiment; {table}_benchmark.csv, a row for each experiment; {table}_comparison.csv, every policy less the
baseline; figures/{table}_budget.png, PSNR against photos; the page results/{table}-selection.md. `snakemake view_benchmark` makes them.

Of one experiment: sphere_{t}.png, the candidates of each round by their scores, and those chosen (the paper's uncertainty sphere);
evolution_{t}.png, two test views after the rounds 0, 1 and t, and where their renders are wrong.
"""


rule compare_policies:
    """The rounds of every cell, the area under each curve, and every policy less the baseline with its interval."""
    input:
        measured=lambda wildcards: [path for cell in benchmark_experiments() for path in cell["metrics"]],
        template=str(HERE / "report/view_selection.md"),
    output:
        curves="study/docs/data/{table}_curves.csv",
        results="study/docs/data/{table}_benchmark.csv",
        compared="study/docs/data/{table}_comparison.csv",
        page="study/docs/results/{table}-selection.md",
        plot="study/docs/figures/{table}_budget.png",
    log:
        "<logs>/benchmark/compare_{table}.log",
    wildcard_constraints:
        table="view|hundred|development",
    params:
        cells=lambda wildcards: benchmark_experiments(),
        baseline=lambda wildcards: STUDY["view_benchmark"]["baseline"],
        groups=lambda wildcards: {
            scene: group["title"] for group in STUDY["view_benchmark"]["sets"] for scene in group["scenes"]
        },
        source=code_of_study("compare_policies"),
    script:
        "../scripts/compare_policies.py"


rule view_benchmark:
    """Compare the policies of the config's `benchmark`."""
    input:
        lambda wildcards: expand(list(rules.compare_policies.output), table=STUDY["view_benchmark"]["table"]),


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
        plot="<results>/<active>/sphere_{t}.png",
    log:
        "<logs>/<active>/plot_sphere_{t}.log",
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
        plot="<results>/<active>/evolution_{t}.png",
    log:
        "<logs>/<active>/plot_evolution_{t}.log",
    wildcard_constraints:
        policy=CHOOSING,
        t=POSITIVE,
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        size=lambda wildcards: config["presets"][wildcards.preset]["fit_size"],
        titles=lambda wildcards: [f"round {t}" for t in figure_rounds(wildcards)],
        source=code_of_study("plot_evolution"),
    script:
        "../scripts/plot_evolution.py"


localrules:
    view_benchmark,
