"""The paper's tables with their own columns from our runs, the paper's values beside them as columns `paper_`; figures.

In: sweeps that the config's `study.tables` names. Out: study/results/tables/timing.csv, sensitivity.csv, ablation.csv, also in
study/docs/data; study/results/figures/estimators_{scene}.png; uncertainty.png beside a bundle.
"""


rule compare_timing:
    """What each stage took in our runs, and what a frame of the viewer takes."""
    input:
        unpack(viewer_times),
        sweep=lambda wildcards: "study/results/sweeps/{timing}.csv".format(**STUDY["tables"]),
    output:
        table=report(
            "study/results/tables/timing.csv",
            caption="../report/timing.rst",
            category="Tables",
            labels={"table": "timing"},
        ),
        kept="study/docs/data/timing.csv",
    log:
        "<logs>/tables/timing.log",
    benchmark:
        "<benchmarks>/tables/timing.tsv"
    params:
        value=lambda wildcards: default_of(STUDY["tables"]["timing"]),
        families=lambda wildcards: {n: s["family"] for n, s in config["scenes"].items() if "family" in s},
        source=code_of_study("compare_timing"),
    script:
        "../scripts/compare_timing.py"


rule tabulate_sensitivity:
    """What one setting changes, the others as they are."""
    input:
        unpack(viewer_times),
        sweeps=swept("sensitivity"),
    output:
        table=report(
            "study/results/tables/sensitivity.csv",
            caption="../report/sensitivity.rst",
            category="Tables",
            labels={"table": "sensitivity"},
        ),
        kept="study/docs/data/sensitivity.csv",
    log:
        "<logs>/tables/sensitivity.log",
    benchmark:
        "<benchmarks>/tables/sensitivity.tsv"
    params:
        settings=lambda wildcards: [setting_of(name) for name in STUDY["tables"]["sensitivity"]],
        defaults=lambda wildcards: {setting_of(name): default_of(name) for name in STUDY["tables"]["sensitivity"]},
        source=code_of_study("tabulate_sensitivity"),
    script:
        "../scripts/tabulate_sensitivity.py"


rule tabulate_ablation:
    """Estimators, policies and ways to cut, each less the baseline of its sweep."""
    input:
        unpack(viewer_times),
        sweeps=swept("ablation"),
    output:
        table=report(
            "study/results/tables/ablation.csv",
            caption="../report/ablation.rst",
            category="Tables",
            labels={"table": "ablation"},
        ),
        kept="study/docs/data/ablation.csv",
    log:
        "<logs>/tables/ablation.log",
    benchmark:
        "<benchmarks>/tables/ablation.tsv"
    params:
        baselines=lambda wildcards: {name: STUDY["sweeps"][name]["baseline"] for name in STUDY["tables"]["ablation"]},
        source=code_of_study("tabulate_ablation"),
    script:
        "../scripts/tabulate_ablation.py"


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
        plot=report(
            "study/results/figures/estimators_{scene}.png",
            caption="../report/estimators.rst",
            category="Figures",
            labels={"figure": "estimators", "scene": "{scene}"},
        ),
    log:
        "<logs>/figures/estimators_{scene}.log",
    benchmark:
        "<benchmarks>/figures/estimators_{scene}.tsv"
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        titles=lambda wildcards: STUDY["tables"]["figures"]["estimators"],
        size=lambda wildcards: config["presets"][config["scenes"][wildcards.scene]["preset"]]["size"],
        source=code_of_study("plot_evolution"),
    script:
        "../scripts/plot_evolution.py"


rule plot_tile_uncertainty:
    """How uncertain the tile in each cell of the terrain is, which keep all orders, and a walk over them."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
    output:
        plot=report(
            "<results>/<bundle>/uncertainty.png",
            caption="../report/uncertainty.rst",
            category="Figures",
            labels={"figure": "uncertainty of tiles", "scene": "{scene}"},
        ),
    log:
        "<logs>/<bundle>/plot_tile_uncertainty.log",
    benchmark:
        "<benchmarks>/<bundle>/plot_tile_uncertainty.tsv"
    params:
        tau=real("tau"),
        length=16.0,
        source=code_of_study("plot_tile_uncertainty"),
    script:
        "../scripts/plot_tile_uncertainty.py"
