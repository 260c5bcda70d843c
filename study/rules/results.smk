"""The study: all tables and figures of the paper from our own runs, and the page that shows them.

In: what the config's `study.tables` names. Out: study/docs/results/results.md with its figures; the pages of `stability` and
`tradeoff`. `snakemake study` makes it, `snakemake study --report page.html` one page of all.
"""


rule write_results:
    """The study's tables and figures as a page of docs/."""
    input:
        **{name: f"study/results/tables/{name}.csv" for name in TABLES},
        figures=lambda wildcards: list(figure_files().values()),
    output:
        page="study/docs/results/results.md",
        lod="study/docs/data/lod.csv",
        figures=[f"study/docs/figures/study_{name}{kept_suffix(name)}" for name in figure_files()],
    log:
        "<logs>/study/write_results.log",
    benchmark:
        "<benchmarks>/study/write_results.tsv"
    params:
        shown=lambda wildcards: captions(),
        source=code_of_study("write_results"),
    script:
        "../scripts/write_results.py"


rule study:
    """All tables and figures of the paper, from our own runs."""
    input:
        expand("study/results/tables/{name}.csv", name=TABLES),
        lambda wildcards: expand("study/results/sweeps/{name}.png", name=sweeps_of(STUDY["tables"])),
        lambda wildcards: list(figure_files().values()) + terrain_sheets(),
        lambda wildcards: [rules.write_results.output.page, rules.write_stability.output.page],
        lambda wildcards: rules.write_tradeoff.output.page,


localrules:
    study,
