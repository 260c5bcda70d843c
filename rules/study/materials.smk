"""Materials and objects against the true labels of a synthetic scene that has them: `snakemake materials_table`.

In: the materials of the scenes of the config's `study.materials`, their true labels. Out: results/tables/materials.csv.
"""


rule measure_materials:
    """Mean IoU of materials and F1 of objects."""
    input:
        materials="<results>/<materials>",
        truth="<results>/<photos>/truth",
    output:
        table="<results>/<round>{inpainted}/materials.csv",
    log:
        "<logs>/<materials>/measure_materials.log",
    benchmark:
        "<benchmarks>/<materials>/measure_materials.tsv"
    params:
        source=code_of("study/measure_materials"),
    script:
        "../../scripts/study/measure_materials.py"


use rule gather_lod as gather_materials with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_materials, "materials")),
    output:
        table=report(
            "results/tables/materials.csv",
            caption="../../workflow/report/materials.rst",
            category="Tables",
            labels={"table": "materials and objects"},
        ),
    log:
        "<logs>/tables/gather_materials.log",
    benchmark:
        "<benchmarks>/tables/gather_materials.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_materials, "materials").values()),
        source=code_of("study/gather_lod"),


rule materials_table:
    """The table of materials and objects."""
    input:
        rules.gather_materials.output.table,
