"""Export: the photos of a round for other programs that train fields; for viewers, engines and simulators a finite
terrain. Not part of `all`: name the path of the file that you want (docs/exports.md).

In: a round's photos; the bundle. Out: of the round exports/model; of the bundle exports/terrain,
exports/ground, and the tile set itself: exports/tiles, gswt.zip.
"""


rule export_model:
    """All photos that a round's field was made of, with their cameras, as COLMAP has them."""
    input:
        captures=captures_until,
        views="<results>/<start>/views.json",
        images="<results>/<photos>/images",
        model="<results>/<photos>/sparse",
    output:
        model=directory("<results>/<round>/exports/model"),
    log:
        "<logs>/<round>/export_model.log",
    benchmark:
        "<benchmarks>/<round>/export_model.tsv"
    wildcard_constraints:
        policy=CHOOSING,
    resources:
        mem_mb=per_attempt(1500),
        runtime=per_attempt("10m"),
    params:
        source=code_of("export_model"),
    script:
        "../scripts/export_model.py"


rule export_terrain:
    """Some cells of the endless terrain, with everything on them, as one file or set a format."""
    input:
        unpack(height_map),
        unpack(painted_files),
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
        frame="<results>/<photos>/ground.json",
    output:
        terrain=directory("<results>/<bundle>/exports/terrain"),
    log:
        "<logs>/<bundle>/export_terrain.log",
    benchmark:
        "<benchmarks>/<bundle>/export_terrain.tsv"
    threads: 2
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("60m"),
    params:
        export=export_keys("export_terrain"),
        heights=lookup(dpath="heights", within=config),
        classes=lookup(dpath="classes", within=config),
        source=code_of("export_terrain"),
    script:
        "../scripts/export_terrain.py"


rule export_ground:
    """The ground under the same cells: a collision mesh, height maps, a model for MuJoCo, hulls of the objects."""
    input:
        unpack(height_map),
        unpack(painted_files),
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
        seams="<results>/<tiles>/seams.json",
        tiles="<results>/<tiles>/tiles",
        levels="<results>/<levels>",
    output:
        ground=directory("<results>/<bundle>/exports/ground"),
    log:
        "<logs>/<bundle>/export_ground.log",
    benchmark:
        "<benchmarks>/<bundle>/export_ground.tsv"
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("20m"),
    params:
        export=export_keys("export_ground"),
        heights=lookup(dpath="heights", within=config),
        classes=lookup(dpath="classes", within=config),
        source=code_of("export_ground"),
    script:
        "../scripts/export_ground.py"


rule export_tiles:
    """The tile set: gswt.zip for the public GSWT renderer, and a PLY a tile and level."""
    input:
        manifest="<results>/<bundle>/davgswt.json",
        parts="<results>/<bundle>/parts",
    output:
        archive="<results>/<bundle>/gswt.zip",
        tiles=directory("<results>/<bundle>/exports/tiles"),
    log:
        "<logs>/<bundle>/export_tiles.log",
    benchmark:
        "<benchmarks>/<bundle>/export_tiles.tsv"
    resources:
        mem_mb=per_attempt(2500),
        runtime=per_attempt("20m"),
    params:
        source=code_of("export_tiles"),
    script:
        "../scripts/export_tiles.py"
