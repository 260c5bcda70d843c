"""Bundle: what a viewer loads. tau enters here: tiles in more doubt than tau keep more pre-sorted orders.

In: the tiles. Out: davgswt.json (the only contract with the viewer), its chunks, and gswt.zip for the public renderer.
"""


rule bundle_tiles:
    """Pack the tiles with their pre-sorted orders."""
    input:
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        frame="<results>/<photos>/ground.json",
    output:
        manifest="<results>/<bundle>/davgswt.json",
        chunks=directory("<results>/<bundle>/chunks"),
        archive="<results>/<bundle>/gswt.zip",
    log:
        "<logs>/<bundle>/bundle_tiles.log",
    benchmark:
        "<benchmarks>/<bundle>/bundle_tiles.tsv"
    resources:
        mem_mb=1500,
        runtime="10m",
    params:
        tau=real("tau"),
        seed=integer("seed"),
        schema=str(Path(workflow.basedir, "workflow/schemas/davgswt.schema.json")),
        source=source_of("bundle"),
    script:
        "../scripts/bundle_tiles.py"
