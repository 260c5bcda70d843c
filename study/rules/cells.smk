"""What the cells of `scale` and the photos of `compare` are, by the config's `study`: functions of their rules."""


def scale_field(wildcards):
    """The field that photos are rendered from, its ground and its frame."""
    asked = STUDY["scale"]
    place = {"scene": asked["scene"], "seed": 0, "preset": asked["field"]}
    photos, coarse = (paths.stage_folder(stage, place) for stage in ("photos", "coarse"))
    return {
        "field": str(coarse / "field.ply"),
        "ground": str(coarse / "ground.exr"),
        "frame": str(photos / "ground.json"),
    }


def scale_photos(what, amount):
    """How many photos of how many pixels a side a cell fits; None: it fits none."""
    asked = STUDY["scale"]
    least = min(asked["photos"]), asked["size"]
    cells = {"photos": (amount, asked["size"]), "pixels": (asked["photos_of_pixels"], amount), "threads": least}
    cells |= {"limits": (asked["photos_of_pixels"], asked["pixels_of_limits"])}
    return cells.get(what)


def changed_preset(what, amount):
    """The keys of the preset that a cell's fit has otherwise."""
    asked = STUDY["scale"]
    few = {"steps": asked["steps_of_pixels"], "steps_per_photo": 0}
    changes = {
        "pixels": few | {"size": amount},
        "limits": few | {"size": asked["pixels_of_limits"], "max_gaussians": amount},
    }
    return changes.get(what, {"size": asked["size"]})


def scale_cells():
    """All cells as (what, amount)."""
    asked = STUDY["scale"] | {"threads": [1, 2]}
    return [
        (what, n)
        for what in ("photos", "pixels", "limits", "gaussians", "candidates", "tiles", "threads")
        for n in asked[what]
    ]


def compared_photos(wildcards):
    """The photo set that all programs fit."""
    folder = paths.stage_folder("photos", {"scene": STUDY["compare"]["scene"]})
    return {"frame": str(folder / "ground.json"), "images": str(folder / "images"), "model": str(folder / "sparse")}
