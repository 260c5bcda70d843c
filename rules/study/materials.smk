"""Materials and objects against the true labels of a synthetic scene that has them: `snakemake materials_table`. How visibly
terrains repeat: `snakemake repetition_table`.

In: the materials of the scenes of the config's `study.materials` and their true labels, the bundles of `study.repetition`.
Out: results/tables/materials.csv, results/tables/repetition.csv, and beside each bundle a picture of 20 x 20 tiles from above.
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


rule measure_lattice:
    """The terrain from above, and how visibly it repeats."""
    input:
        unpack(class_pictures),
        manifest="<results>/<bundle>/davgswt.json",
        chunks="<results>/<bundle>/chunks",
    output:
        table="<results>/<bundle>/lattice/lattice.csv",
        picture="<results>/<bundle>/lattice/above.png",
    log:
        "<logs>/<bundle>/measure_lattice.log",
    benchmark:
        "<benchmarks>/<bundle>/measure_lattice.tsv"
    resources:
        mem_mb=per_attempt(4000),
    params:
        classes=lookup(dpath="classes", within=config),
        schema=BUNDLE_SCHEMA,
        source=code_of("study/measure_lattice"),
    script:
        "../../scripts/study/measure_lattice.py"


use rule gather_lod as gather_repetition with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_lattice, "repetition")),
    output:
        table=report(
            "results/tables/repetition.csv",
            caption="../../workflow/report/repetition.rst",
            category="Tables",
            labels={"table": "repetition"},
        ),
    log:
        "<logs>/tables/gather_repetition.log",
    benchmark:
        "<benchmarks>/tables/gather_repetition.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_lattice, "repetition").values()),
        source=code_of("study/gather_lod"),


rule repetition_table:
    """The table of repetition."""
    input:
        rules.gather_repetition.output.table,
