"""Materials and objects against the true labels of a synthetic scene that has them, and how visibly terrains repeat, with the
pictures of study/docs/results/materials.md: `snakemake materials_pages`.

In: the materials of the scenes of the config's `study.materials`, the bundles of `study.lattice`.
Out: study/results/tables/materials.csv, study/results/tables/lattice.csv, and beside each bundle a picture of 20 x 20 tiles from above.
"""


rule measure_materials:
    """Mean IoU of materials and F1 of objects."""
    input:
        materials="<results>/<materials>",
    output:
        table="<results>/<round>{inpainted}/materials.csv",
    log:
        "<logs>/<materials>/measure_materials.log",
    wildcard_constraints:
        scene=scenes_of("synthetic"),
    resources:
        mem_mb=per_attempt(2500),
    params:
        scene=scene_keys("render_photos"),
        source=code_of_study("measure_materials"),
    script:
        "../scripts/measure_materials.py"


rule measure_lattice:
    """The terrain from above, and how visibly it repeats."""
    input:
        unpack(painted_files),
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
    output:
        table="<results>/<bundle>/lattice/lattice.csv",
        picture="<results>/<bundle>/lattice/above.png",
    log:
        "<logs>/<bundle>/measure_lattice.log",
    resources:
        mem_mb=per_attempt(4000),
    params:
        classes=lookup(dpath="classes", within=config),
        source=code_of_study("measure_lattice"),
    script:
        "../scripts/measure_lattice.py"


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
    params:
        source=code_of_study("draw_materials_sheet"),
    script:
        "../scripts/draw_materials_sheet.py"


rule write_materials_page:
    """The page about materials, from its template and its tables, and the verdict on each scene and each of its materials."""
    input:
        materials="study/results/tables/materials.csv",
        lattice="study/results/tables/lattice.csv",
        found=lambda wildcards: [
            folder
            for scene in STUDY["lattice"]["scenes"]
            for folder in expand(rules.find_materials.output.materials, **made_of(scene))
        ],
        template=str(HERE / "report/materials_page.md"),
    output:
        page="study/docs/results/materials.md",
        materials="study/docs/data/materials.csv",
        lattice="study/docs/data/lattice.csv",
        verdicts="study/docs/data/verdicts.csv",
    log:
        "<logs>/tables/write_materials_page.log",
    params:
        scenes=lambda wildcards: STUDY["lattice"]["scenes"],
        source=code_of_study("write_materials_page"),
    script:
        "../scripts/write_materials_page.py"


rule materials_pages:
    """study/docs/results/materials.md with its tables and pictures."""
    input:
        rules.write_materials_page.output.page,
        expand(rules.draw_materials_sheet.output, shown=STUDY.get("lattice", {}).get("scenes", [])),
