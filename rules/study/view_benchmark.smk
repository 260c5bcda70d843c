"""View benchmark: policies compared photo by photo, from the same photos to start from, pools and test views.

In: the experiments of the config's `study.view_benchmark`, each a scene, a seed, a policy and k. Out:
docs/research/data/{table}_curves.csv, a row for each round of an experiment; {table}_benchmark.csv, a row for each experiment;
{table}_comparison.csv, every policy less the baseline; {table}_worth.csv, what rounds gained against what was expected of
them; figures/{table}_budget.png, PSNR against photos; the page results/{table}-selection.md.
`snakemake view_benchmark` makes them.
"""


rule gather_curves:
    """Collect what every round of every cell measured, and what it cost."""
    input:
        measured=lambda wildcards: [
            path for cell in benchmark_experiments() for path in (*cell["metrics"], *cell["facts"])
        ],
    output:
        curves="docs/research/data/{table}_curves.csv",
    log:
        "<logs>/benchmark/gather_{table}.log",
    benchmark:
        "<benchmarks>/benchmark/gather_{table}.tsv"
    wildcard_constraints:
        table="view|hundred|development",
    params:
        cells=lambda wildcards: benchmark_experiments(),
        source=code_of("study/gather_curves"),
    script:
        "../../scripts/study/gather_curves.py"


rule compare_policies:
    """Area under each curve, and every policy less the baseline with its interval."""
    input:
        curves="docs/research/data/{table}_curves.csv",
        template=str(BASE / "workflow/report/view_selection.md"),
    output:
        results="docs/research/data/{table}_benchmark.csv",
        compared="docs/research/data/{table}_comparison.csv",
        page="docs/research/results/{table}-selection.md",
        worth="docs/research/data/{table}_worth.csv",
        plot="docs/research/figures/{table}_budget.png",
    log:
        "<logs>/benchmark/compare_{table}.log",
    benchmark:
        "<benchmarks>/benchmark/compare_{table}.tsv"
    wildcard_constraints:
        table="view|hundred|development",
    params:
        baseline=lambda wildcards: STUDY["view_benchmark"]["baseline"],
        groups=lambda wildcards: {
            scene: group["title"] for group in STUDY["view_benchmark"]["sets"] for scene in group["scenes"]
        },
        source=code_of("study/compare_policies"),
    script:
        "../../scripts/study/compare_policies.py"


rule view_benchmark:
    """Compare the policies of the config's `benchmark`."""
    input:
        lambda wildcards: expand(list(rules.compare_policies.output), table=STUDY["view_benchmark"]["table"]),


rule bound_gain:
    """Let policies and the greedy choice by true gain choose from the same pool."""
    input:
        unpack(lpips_weights),
        views=lambda wildcards: first_start(wildcards, "gain_bound"),
        frame="<results>/<photos>/ground.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        table="docs/research/data/gain_bound_{scene}.csv",
    log:
        "<logs>/benchmark/bound_gain_{scene}.log",
    benchmark:
        "<benchmarks>/benchmark/bound_gain_{scene}.tsv"
    wildcard_constraints:
        scene="|".join(STUDY["gain_bound"]) or NEVER,
    threads: 2
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("120m"),
    params:
        bound=lambda wildcards: STUDY["gain_bound"][wildcards.scene],
        whole=lambda wildcards: config["scenes"][wildcards.scene].get("whole", False),
        source=code_of("study/bound_gain"),
    script:
        "../../scripts/study/bound_gain.py"


rule gain_bound:
    """The bound of view selection on every scene of the config's `study.gain_bound`."""
    input:
        expand("docs/research/data/gain_bound_{scene}.csv", scene=STUDY["gain_bound"]),


localrules:
    view_benchmark,
    gain_bound,
