"""View benchmark: policies compared photo by photo, from the same photos to start from, pools and test views.

In: the experiments of the config's `study.view_benchmark`, each a scene, a seed, a policy and k. Out:
study/docs/data/{table}_curves.csv, a row for each round of an experiment; {table}_benchmark.csv, a row for each experiment;
{table}_comparison.csv, every policy less the baseline; figures/{table}_budget.png, PSNR against photos; the page results/{table}-selection.md.
`snakemake view_benchmark` makes them.
"""


rule gather_curves:
    """Collect what every round of every cell measured, and what it cost."""
    input:
        measured=lambda wildcards: [
            path for cell in benchmark_experiments() for path in (*cell["metrics"], *cell["facts"])
        ],
    output:
        curves="study/docs/data/{table}_curves.csv",
    log:
        "<logs>/benchmark/gather_{table}.log",
    benchmark:
        "<benchmarks>/benchmark/gather_{table}.tsv"
    wildcard_constraints:
        table="view|hundred|development",
    params:
        cells=lambda wildcards: benchmark_experiments(),
        source=code_of_study("gather_curves"),
    script:
        "../scripts/gather_curves.py"


rule compare_policies:
    """Area under each curve, and every policy less the baseline with its interval."""
    input:
        curves="study/docs/data/{table}_curves.csv",
        template=str(HERE / "report/view_selection.md"),
    output:
        results="study/docs/data/{table}_benchmark.csv",
        compared="study/docs/data/{table}_comparison.csv",
        page="study/docs/results/{table}-selection.md",
        plot="study/docs/figures/{table}_budget.png",
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
        source=code_of_study("compare_policies"),
    script:
        "../scripts/compare_policies.py"


rule view_benchmark:
    """Compare the policies of the config's `benchmark`."""
    input:
        lambda wildcards: expand(list(rules.compare_policies.output), table=STUDY["view_benchmark"]["table"]),


localrules:
    view_benchmark,
