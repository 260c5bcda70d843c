"""Scenes of docs/gallery.md: each one's files."""

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
