"""The study: all tables and figures of the paper from our own runs, and docs/research/results/results.md, which shows them.

In: what the config's `study` names. Out: results/tables/{timing,lod,sensitivity,ablation}.csv, results/sweeps/*.png,
results/figures/, figures beside what they show; docs/research/results/results.md with docs/research/figures/study_*; the pages of `stability`
and `tradeoff`. Not part of `all`: `snakemake study` makes it, with `--max-threads 1` a core to each cell;
`snakemake study --report page.html` a page of it.
"""


rule write_results:
    """The study's tables and figures as a page of docs/."""
    input:
        **{name: f"results/tables/{name}.csv" for name in TABLES},
        figures=lambda wildcards: list(study_figures().values()),
    output:
        page="docs/research/results/results.md",
        lod="docs/research/data/lod.csv",
        figures=[f"docs/research/figures/study_{name}{kept_as(name)}" for name in study_figures()],
    log:
        "<logs>/study/write_results.log",
    benchmark:
        "<benchmarks>/study/write_results.tsv"
    params:
        shown=lambda wildcards: captions(),
        source=code_of("study/write_results"),
    script:
        "../../scripts/study/write_results.py"


rule study:
    """All tables and figures of the paper, from our own runs."""
    input:
        *STUDY,
