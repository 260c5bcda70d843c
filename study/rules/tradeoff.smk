"""Speed against accuracy: each setting of the config's `study.tradeoff` turned by itself, and presets scene by scene.

In: what each experiment left, and its jobs' benchmarks. Out: study/results/tradeoff/{tradeoff,pareto}.csv; study/docs/data/tradeoff.csv,
where runs add up; study/docs/figures/tradeoff_{pareto,knobs}.png; study/docs/results/tradeoff.md; of `study.preset_costs`
study/docs/data/preset_costs.csv and study/docs/results/presets.md. Seconds differ from machine to machine: one that is otherwise idle
is to run all of it. `snakemake tradeoff`, `snakemake preset_costs`.
"""


rule evaluate_at:
    """Compare a round's field with the test photos at another size than it was fitted at."""
    input:
        unpack(lpips_weights),
        field="<results>/<round>/field.ply",
        ground="<results>/<round>/ground.exr",
        fit="<results>/<round>/fit.json",
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
        frame="<results>/<photos>/ground.json",
    output:
        metrics="<results>/<round>/metrics_{size}.json",
    log:
        "<logs>/<round>/evaluate_at_{size}.log",
    wildcard_constraints:
        t=POSITIVE,
    threads: 2
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        preset=lambda wildcards: preset_keys("evaluate_round")(wildcards) | {"fit_size": int(wildcards.size)},
        t=integer("t"),
        source=code_of("evaluate_field"),
    script:
        "../../scripts/evaluate_field.py"


rule compare_settings:
    """What every setting costs, what it is worth, and which of them nothing else beats: tables, figures and the page."""
    input:
        measured=lambda wildcards: files_of(tradeoff_experiments()),
        template=str(HERE / "report/tradeoff.md"),
    output:
        table="study/results/tradeoff/tradeoff.csv",
        pareto="study/results/tradeoff/pareto.csv",
        kept=update("study/docs/data/tradeoff.csv"),
        fronts="study/docs/figures/tradeoff_pareto.png",
        knobs="study/docs/figures/tradeoff_knobs.png",
        page="study/docs/results/tradeoff.md",
    log:
        "<logs>/tradeoff/compare_settings.log",
    params:
        cells=lambda wildcards: tradeoff_experiments(),
        source=code_of_study("compare_settings"),
    script:
        "../scripts/compare_settings.py"


rule tradeoff:
    """Speed against accuracy: tables, figures and pages."""
    input:
        rules.compare_settings.output,


rule gather_preset_costs:
    """A row for each scene and preset, and the page."""
    input:
        measured=lambda wildcards: files_of(preset_experiments()),
        template=str(HERE / "report/presets.md"),
    output:
        table="study/docs/data/preset_costs.csv",
        page="study/docs/results/presets.md",
    log:
        "<logs>/tables/gather_preset_costs.log",
    params:
        cells=lambda wildcards: preset_experiments(),
        size=lambda wildcards: STUDY["preset_costs"]["size"],
        source=code_of_study("gather_presets"),
    script:
        "../scripts/gather_presets.py"


rule preset_costs:
    """What presets cost and are worth: table and page."""
    input:
        rules.gather_preset_costs.output,


localrules:
    tradeoff,
    preset_costs,
