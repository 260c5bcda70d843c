"""Ground truth of synthetic pictures: depth and label at the centre of every pixel.

It is stored as an EXR with the channels Z (camera depth, infinite in the sky) and label. The header holds the names of
the labels and the camera as JSON.
"""

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera, camera_to_json
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import mitsuba_scene
from dav_gswt.photos.synthetic import scene as synthetic

SKY, GROUND, STONE, PLANT = range(4)
LABELS = {"sky": SKY, "ground": GROUND, "stone": STONE, "plant": PLANT}
ROCKY = ("planet",)  # families whose instances are stones; the instances of other families are plants
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
    depth, parts = mitsuba_scene.render_depth(synthetic.load_scene(scene).world, camera), load_parts(scene)
    ground = mitsuba_scene.render_depth(parts["ground"], camera)
    stones = mitsuba_scene.render_depth(parts["stones"], camera) if "stones" in parts else np.full_like(depth, np.inf)
    instance = STONE if scene.family in ROCKY else PLANT
    label = np.where(stones < ground, STONE, GROUND)
    label = np.where(depth < np.minimum(ground, stones) * (1 - TOLERANCE), instance, label)
    return depth, np.where(np.isinf(depth), SKY, label).astype(np.float32)


@lru_cache(maxsize=1)
def load_parts(scene: synthetic.Scene) -> dict:
    """Parts of a scene alone: its ground, and its stones if it has any."""
    return mitsuba_scene.isolate_shapes(synthetic.load_scene(scene).world)


def write_truth(path: Path | str, scene: synthetic.Scene, camera: Camera) -> None:
    """Render and write the ground truth of a camera."""
    depth, label = render_truth(scene, camera)
    header = {"labels": json.dumps(LABELS), "camera": json.dumps(camera_to_json(camera))}
    image_files.write_exr(path, {"Z": depth, "label": label}, header)
