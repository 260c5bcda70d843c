"""Materials: the classes of ground of the exemplar, an exemplar of each alone, and the single objects on them.

In: the last round's field and ground, and the masks that the config names. Out: materials/ with
materials.json (shares, verdicts, objects), a picture, the label map materials.exr, material{k}.ply and object{kk}.ply. Scenes with `materials: one` have none.
"""


rule find_materials:
    """Tell materials and objects apart; fill each material's exemplar with its own ground."""
    input:
        unpack(maps_of_prior),
        unpack(masks_of_materials),
        unpack(draft_of),
    output:
        materials=report(
            directory("<results>/<materials>"),
            patterns=["materials.png"],
            caption="../workflow/report/materials_found.rst",
            category="Materials",
            labels={"scene": "{scene}", "preset": "{preset}"},
        ),
    log:
        "<logs>/<materials>/find_materials.log",
    benchmark:
        "<benchmarks>/<materials>/find_materials.tsv"
    resources:
        mem_mb=per_attempt(3000),
        runtime=per_attempt("20m"),
    params:
        seed=integer("seed"),
        source=code_of("find_materials"),
    script:
        "../scripts/find_materials.py"
