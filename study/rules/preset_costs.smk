"""What presets cost and what they are worth, scene by scene: the config's `study.preset_costs`.

In: metrics at one size, bundles and benchmarks of each scene with each preset. Out: study/docs/data/preset_costs.csv and
study/docs/results/presets.md. Seconds differ from machine to machine: one that is otherwise idle is to run all of it.
"""


rule gather_preset_costs:
    """A row for each scene and preset, and the page."""
    input:
        measured=lambda wildcards: [cell[key] for cell in preset_experiments() for key in ("metrics", "manifest")],
    output:
        table="study/docs/data/preset_costs.csv",
        page="study/docs/results/presets.md",
    log:
        "<logs>/tables/gather_preset_costs.log",
    benchmark:
        "<benchmarks>/tables/gather_preset_costs.tsv"
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
    preset_costs,
