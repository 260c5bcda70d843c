"""Ground truth of synthetic pictures: depth and label at the centre of every pixel.

It is stored as an EXR with the channels Z (camera depth, infinite in the sky) and label; the header holds the names of
the labels and the camera as JSON. Families that know their materials and objects (`labels`) add the channels material
and object, with the numbers of the map from above.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera, camera_from_json, camera_to_json
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import labels
from dav_gswt.photos.synthetic import scene as synthetic

SKY, GROUND, STONE, PLANT = range(4)
LABELS = {"sky": SKY, "ground": GROUND, "stone": STONE, "plant": PLANT}
ROCKY = ("planet",)  # families whose instances are stones; those of others are plants
TOLERANCE = 1e-6  # relative difference of two depths of the same surface
NUDGE = 1e-3  # pixels by which rays that missed the ground are moved


def render_truth(scene: synthetic.Scene, camera: Camera) -> tuple[Float32[Array, "h w"], Float32[Array, "h w"]]:
    """Depth and label of every pixel.

    A pixel as far as the ground alone, or the stones alone, is of these; a nearer one is of an instance. About one ray
    in a hundred thousand passes between two triangles of the ground, so pixels of sky are rendered again NUDGE beside
    their centres.
    """
    depth, label = _render_labels(scene, camera)
    sky = label == SKY
    if sky.any():
        nudged = replace(camera, cx=camera.cx + NUDGE, cy=camera.cy + 0.7 * NUDGE)
        for values, again in zip((depth, label), _render_labels(scene, nudged), strict=True):
            values[sky] = again[sky]
    return depth, label


def _render_labels(scene: synthetic.Scene, camera: Camera) -> tuple[Float32[Array, "h w"], Float32[Array, "h w"]]:
    depth, isolated = synthetic.render_depth(scene, camera), synthetic.render_isolated_depths(scene, camera)
    sky = np.full_like(depth, np.inf)
    ground, stones = (isolated.get(name, sky) for name in ("ground", "stones"))
    instance = STONE if scene.family in ROCKY else PLANT
    label = np.where(stones < ground, STONE, GROUND)
    label = np.where(depth < np.minimum(ground, stones) * (1 - TOLERANCE), instance, label)
    return depth, np.where(np.isinf(depth), SKY, label).astype(np.float32)


def write_truth(path: Path | str, scene: synthetic.Scene, camera: Camera) -> None:
    """Render and write the ground truth of a camera."""
    depth, label = render_truth(scene, camera)
    header = {"labels": json.dumps(LABELS), "camera": json.dumps(camera_to_json(camera))}
    channels = {"Z": depth, "label": label}
    if (known := synthetic.load_labels(scene)) is not None:
        objects = synthetic.render_isolated_depths(scene, camera, ("objects",)).get("objects")
        channels |= label_surfaces(known, camera, depth, label, objects)
        header["materials"] = json.dumps(known.materials)
    image_files.write_exr(path, channels, header)


def label_surfaces(
    known: labels.GroundLabels,
    camera: Camera,
    depth: Float32[Array, "h w"],
    label: Float32[Array, "h w"],
    objects: Float32[Array, "h w"] | None,
) -> dict[str, Float32[Array, "h w"]]:
    """The material and the object of every pixel, 0 where there is none.

    The material is that of the ground at the place (x, y) that is seen. objects: depth of the plants that are objects.
    """
    origin, step = camera.rays()
    seen = np.isfinite(depth)
    x, y, _ = np.moveaxis(origin + step * np.where(seen, depth, 0)[..., None], -1, 0)
    shrub = seen & (depth >= objects * (1 - TOLERANCE)) if objects is not None else np.zeros_like(seen)
    found = np.where(shrub, labels.label_places(known, x, y, "shrub"), 0)
    found = np.where(label == STONE, labels.label_places(known, x, y, "boulder"), found)
    material = np.where(seen, known.material_at(x, y), 0)
    return {"material": material.astype(np.float32), "object": found.astype(np.float32)}


def read_truth(path: Path | str) -> tuple[Float32[Array, "h w"], Float32[Array, "h w"], Camera]:
    """Depth, label and camera of a file of `write_truth`. Raises: InputError: unreadable, or another kind of file."""
    channels, header = image_files.read_exr(path)
    try:
        return channels["Z"], channels["label"], camera_from_json(json.loads(header["camera"]))
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: no depth, labels and camera of a synthetic picture ({error})") from error
