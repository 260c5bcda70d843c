"""The study: all tables and figures of the paper from our own runs, and docs/results.md, which shows them.

In: what the config's `study` names. Out: results/tables/{timing,lod,sensitivity,ablation}.csv, results/sweeps/*.png,
results/figures/, figures beside what they show; docs/results.md with docs/figures/study_*.png. Not part of `all`:
`snakemake study` makes it, `snakemake study --report page.html` a page of it.
"""

from dav_gswt.tables.asked import sweeps_of

TABLES = ("timing", "lod", "sensitivity", "ablation")


def study_figures():
    """The paper's figures: the path of each, by its name in docs/figures; they are of scenes, seed and policy of `study`."""
    asked, found = config["study"]["figures"], {}
    for scene in asked["scenes"]:
        values = shown_estimator(scene, asked["policy"])
        shown = {
            "sphere": rules.plot_sphere.output.plot,
            "evolution": rules.plot_evolution.output.plot,
            "estimators": rules.plot_estimators.output.plot,
            "cuts": rules.show_cuts.output.plot,
            "doubt": rules.plot_doubt.output.plot,
        }
        found |= {f"{name}_{scene}": expand(path, **values)[0] for name, path in shown.items()}
    return found | {"budget": "results/sweeps/budget.png"}


def captions():
    """What the figures of the study show, in their order."""
    about = {
        "sphere": "candidates by what scores said of them, and what was chosen",
        "evolution": "two test views after the first rounds",
        "estimators": "test views after as many photos, chosen by each estimator",
        "cuts": "cuts by colours and by what the ground is",
        "doubt": "uncertainty of tiles, and a walk over them",
    }
    return [
        f"{name.partition('_')[2]}: {about[name.partition('_')[0]]}" if "_" in name else "quality against photos"
        for name in study_figures()
    ]


rule write_results:
    """The study's tables and figures as a page of docs/."""
    input:
        **{name: f"results/tables/{name}.csv" for name in TABLES},
        figures=lambda wildcards: list(study_figures().values()),
    output:
        page="docs/results.md",
        lod="docs/data/lod.csv",
        figures=[f"docs/figures/study_{name}.png" for name in study_figures()],
    log:
        "<logs>/study/write_results.log",
    benchmark:
        "<benchmarks>/study/write_results.tsv"
    params:
        shown=lambda wildcards: captions(),
        source=source_of("tables/results", "tables/paper", "tables/paired"),
    script:
        "../scripts/write_results.py"


# What `snakemake study` makes: functions that give paths. Other stages add theirs.
STUDY = [
    lambda wildcards: [f"results/tables/{name}.csv" for name in TABLES],
    lambda wildcards: [f"results/sweeps/{name}.png" for name in sweeps_of(config["study"])],
    lambda wildcards: list(study_figures().values()),
    lambda wildcards: [rules.write_results.output.page],
]


rule study:
    """All tables and figures of the paper, from our own runs."""
    input:
        *STUDY,


localrules:
    study,
