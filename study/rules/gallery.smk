"""What terrains look like: docs/gallery.md, a picture of each scene, and a walk. `snakemake gallery_page`.

In: photos, stills, metrics, materials and bundles of the scenes of the config's `study.gallery`. Out: docs/gallery.md,
docs/figures/gallery_{scene}.jpg, docs/figures/walk.webp.
"""

GALLERY = STUDY.get("gallery", {"scenes": [], "walk": "", "rate": 1})


def gallery_cells():
    """Of each scene of the gallery its files."""
    return [gallery_cell(scene) for scene in GALLERY["scenes"]]


def gallery_cell(scene):
    """One of them."""
    values, entry = made_of(scene), config["scenes"][scene]
    (metrics,), (manifest,) = (
        expand(path, **values) for path in (rules.evaluate_round.output.metrics, rules.bundle_tiles.output.manifest)
    )
    told = entry.get("materials", "one") != "one"
    materials = expand(rules.find_materials.output.materials, **values)[0] if told else None
    return {"scene": scene, "kind": entry["kind"], "metrics": metrics, "manifest": manifest, "materials": materials}


rule draw_scene:
    """A photo, the terrain from above, and what a walker sees, side by side."""
    input:
        images=lambda wildcards: expand(rules.register_photos.output.images, scene=wildcards.shown),
        views=lambda wildcards: expand(rules.split_views.output.views, **made_of(wildcards.shown)),
        stills=lambda wildcards: expand(rules.render_terrain.output.stills, **made_of(wildcards.shown)),
    output:
        picture="docs/figures/gallery_{shown}.jpg",
    log:
        "<logs>/figures/gallery_{shown}.log",
    params:
        source=code_of_study("draw_scene"),
    script:
        "../scripts/draw_scene.py"


rule draw_walk:
    """A walk over the terrain while the sun moves, as one moving picture."""
    input:
        unpack(height_map),
        unpack(painted_files),
        manifest=lambda wildcards: expand(rules.bundle_tiles.output.manifest, **made_of(GALLERY["walk"])),
        parts=lambda wildcards: expand(rules.bundle_tiles.output.parts, **made_of(GALLERY["walk"])),
    output:
        picture="docs/figures/walk.webp",
    log:
        "<logs>/figures/draw_walk.log",
    threads: 2
    resources:
        mem_mb=per_attempt(4000),
        runtime=per_attempt("4h"),
    params:
        size={key: GALLERY.get(key) for key in ("width", "height")},
        heights=lookup(dpath="heights", within=config),
        sun=lookup(dpath="sun", within=config),
        hours=GALLERY.get("hours"),
        classes=lookup(dpath="classes", within=config),
        flight=GALLERY.get("flight"),
        rate=GALLERY["rate"],
        source=code_of_study("draw_walk"),
    script:
        "../scripts/draw_walk.py"


rule write_gallery:
    """Scenes, their verdicts and numbers, and a walk, on a page."""
    input:
        expand(rules.draw_scene.output.picture, shown=GALLERY["scenes"]),
        rules.draw_walk.output.picture,
        lambda wildcards: [
            cell[key] for cell in gallery_cells() for key in ("metrics", "manifest", "materials") if cell[key]
        ],
        template=str(HERE / "report/gallery.md"),
    output:
        page="docs/gallery.md",
    log:
        "<logs>/figures/write_gallery.log",
    params:
        cells=lambda wildcards: gallery_cells(),
        walk=GALLERY["walk"],
        seconds=GALLERY.get("flight", {}).get("frames", 0) / GALLERY["rate"],
        source=code_of_study("write_gallery"),
    script:
        "../scripts/write_gallery.py"


rule gallery_page:
    """The gallery of the docs."""
    input:
        rules.write_gallery.output.page,
