"""Materials and objects against the true labels of a synthetic scene that has them: `snakemake materials_table`. How visibly
terrains repeat: `snakemake lattice_table`. Both with the pictures of study/docs/results/materials.md: `snakemake materials_pages`.

In: the materials of the scenes of the config's `study.materials` and their true labels, the bundles of `study.lattice`.
Out: study/results/tables/materials.csv, study/results/tables/lattice.csv, and beside each bundle a picture of 20 x 20 tiles from above.
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
        source=code_of_study("measure_materials"),
    script:
        "../scripts/measure_materials.py"


use rule gather_lod as gather_materials with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_materials, "materials")),
    output:
        table=report(
            "study/results/tables/materials.csv",
            caption="../report/materials.rst",
            category="Tables",
            labels={"table": "materials and objects"},
        ),
        kept="study/docs/data/materials.csv",
    log:
        "<logs>/tables/gather_materials.log",
    benchmark:
        "<benchmarks>/tables/gather_materials.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_materials, "materials").values()),
        source=code_of_study("gather_lod"),


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
        source=code_of_study("measure_lattice"),
    script:
        "../scripts/measure_lattice.py"


use rule gather_lod as gather_lattice with:
    input:
        tables=lambda wildcards: list(measured_of_tiles(rules.measure_lattice, "lattice")),
    output:
        table=report(
            "study/results/tables/lattice.csv",
            caption="../report/lattice.rst",
            category="Tables",
            labels={"table": "repetition of terrains"},
        ),
        kept="study/docs/data/lattice.csv",
    log:
        "<logs>/tables/gather_lattice.log",
    benchmark:
        "<benchmarks>/tables/gather_lattice.tsv"
    params:
        cells=lambda wildcards: list(measured_of_tiles(rules.measure_lattice, "lattice").values()),
        source=code_of_study("gather_lod"),


rule lattice_table:
    """The table of repetition."""
    input:
        rules.gather_lattice.output.table,


rule draw_materials_sheet:
    """What was found over the ground, and the terrain from above, obliquely, and as a walker sees it."""
    input:
        materials=lambda wildcards: expand(rules.find_materials.output.materials, **made_of(wildcards.shown)),
        above=lambda wildcards: expand(rules.measure_lattice.output.picture, **made_of(wildcards.shown)),
        stills=lambda wildcards: expand(rules.render_terrain.output.stills, **made_of(wildcards.shown)),
    output:
        sheet="study/docs/figures/materials_{shown}.jpg",
    log:
        "<logs>/figures/materials_{shown}.log",
    benchmark:
        "<benchmarks>/figures/materials_{shown}.tsv"
    params:
        source=code_of_study("draw_materials_sheet"),
    script:
        "../scripts/draw_materials_sheet.py"


rule gather_verdicts:
    """The verdict on each scene and on each of its materials."""
    input:
        materials=[
            folder
            for scene in STUDY.get("lattice", {}).get("scenes", [])
            for folder in expand(rules.find_materials.output.materials, **made_of(scene))
        ],
    output:
        table=report(
            "study/results/tables/verdicts.csv",
            caption="../report/verdicts.rst",
            category="Tables",
            labels={"table": "verdicts on materials"},
        ),
        kept="study/docs/data/verdicts.csv",
    log:
        "<logs>/tables/gather_verdicts.log",
    benchmark:
        "<benchmarks>/tables/gather_verdicts.tsv"
    params:
        scenes=STUDY.get("lattice", {}).get("scenes", []),
        source=code_of_study("gather_verdicts"),
    script:
        "../scripts/gather_verdicts.py"


rule write_materials_page:
    """The page about materials, from its template and its tables."""
    input:
        materials=rules.gather_materials.output.kept,
        lattice=rules.gather_lattice.output.kept,
        verdicts=rules.gather_verdicts.output.kept,
        template=str(HERE / "report/materials_page.md"),
    output:
        page="study/docs/results/materials.md",
    log:
        "<logs>/tables/write_materials_page.log",
    benchmark:
        "<benchmarks>/tables/write_materials_page.tsv"
    params:
        source=code_of_study("write_materials_page"),
    script:
        "../scripts/write_materials_page.py"


rule materials_pages:
    """study/docs/results/materials.md with its tables and pictures."""
    input:
        rules.write_materials_page.output.page,
        expand(rules.draw_materials_sheet.output, shown=STUDY.get("lattice", {}).get("scenes", [])),
