"""The paper's tables with their own columns from our runs, the paper's values beside them as columns `paper_`; figures.

In: sweeps that the config's `study.tables` names. Out: study/docs/data/timing.csv, sensitivity.csv, ablation.csv;
study/results/figures/estimators_{scene}.png; uncertainty.png beside a bundle; the page study/docs/results/results.md.
`snakemake study` makes all of it, and the pages of `stability` and `tradeoff`.
"""


rule tabulate_paper:
    """Stages and frames in time; what one setting changes; estimators, policies and cuts less the baseline of their sweep."""
    input:
        unpack(viewer_times),
        sweeps=lambda wildcards: [f"study/results/sweeps/{name}.csv" for name in tabled_sweeps()],
    output:
        timing="study/docs/data/timing.csv",
        sensitivity="study/docs/data/sensitivity.csv",
        ablation="study/docs/data/ablation.csv",
    log:
        "<logs>/tables/tabulate_paper.log",
    params:
        asked=lambda wildcards: STUDY["tables"],
        baselines=lambda wildcards: {name: STUDY["sweeps"][name].get("baseline") for name in tabled_sweeps()},
        settings=lambda wildcards: {name: setting_of(name) for name in tabled_sweeps()},
        defaults=lambda wildcards: {(key := setting_of(name)): str(config.get(key, "")) for name in tabled_sweeps()},
        families=lambda wildcards: {n: s["family"] for n, s in config["scenes"].items() if "family" in s},
        source=code_of_study("tabulate_paper"),
    script:
        "../scripts/tabulate_paper.py"


rule plot_estimators:
    """The same test views after as many photos, chosen by different estimators of what is not known."""
    input:
        fields=of_estimators(rules.update_field.output.field),
        grounds=of_estimators(rules.update_field.output.ground),
        metrics=of_estimators(rules.evaluate_round.output.metrics),
        crops=of_estimators(rules.measure_seams.output.crops),
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        plot="study/results/figures/estimators_{scene}.png",
    log:
        "<logs>/figures/estimators_{scene}.log",
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        titles=lambda wildcards: STUDY["tables"]["figures"]["estimators"],
        size=lambda wildcards: config["presets"][config["scenes"][wildcards.scene]["preset"]]["fit_size"],
        source=code_of_study("plot_evolution"),
    script:
        "../scripts/plot_evolution.py"


rule plot_tile_uncertainty:
    """How uncertain the tile in each cell of the terrain is, which keep all orders, and a walk over them."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
    output:
        plot="<results>/<bundle>/uncertainty.png",
    log:
        "<logs>/<bundle>/plot_tile_uncertainty.log",
    params:
        tau=real("tau"),
        length=16.0,
        source=code_of_study("plot_tile_uncertainty"),
    script:
        "../scripts/plot_tile_uncertainty.py"


rule write_results:
    """The study's tables and figures as a page of docs/."""
    input:
        **dict(rules.tabulate_paper.output.items()),
        lod="study/results/tables/lod.csv",
        figures=lambda wildcards: list(figure_files().values()),
        template=str(HERE / "report/results.md"),
    output:
        page="study/docs/results/results.md",
        lod="study/docs/data/lod.csv",
        figures=[f"study/docs/figures/study_{name}{kept_suffix(name)}" for name in figure_files()],
    log:
        "<logs>/study/write_results.log",
    params:
        shown=lambda wildcards: captions(),
        source=code_of_study("write_results"),
    script:
        "../scripts/write_results.py"


rule study:
    """All tables and figures of the paper, from our own runs."""
    input:
        rules.write_results.output,
        rules.write_stability.output.page,
        rules.compare_settings.output.page,
        lambda wildcards: expand("study/results/sweeps/{name}.png", name=[*tabled_sweeps(), *STUDY["tables"]["also"]]),


localrules:
    study,
