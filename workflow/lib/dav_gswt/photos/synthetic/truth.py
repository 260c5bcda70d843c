"""What a picture of a synthetic scene shows, exactly: depth and kind of thing at the centre of every pixel.

A file of it is an EXR of the channels Z (camera depth, infinite where the sky is seen) and label; its header holds what
the labels mean and the camera, as JSON.
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
from dav_gswt.photos.synthetic import scene as synthetic

SKY, GROUND, STONE, PLANT = range(4)
LABELS = {"sky": SKY, "ground": GROUND, "stone": STONE, "plant": PLANT}
ROCKY = ("planet",)  # families whose strewn things are stones; of the others they are plants
SAME = 1e-6  # share of a depth by which two may differ that are of the same surface: float32 and the order of a search
NUDGE = 1e-3  # pixels


def seen(scene: synthetic.Scene, camera: Camera) -> tuple[Float32[Array, "h w"], Float32[Array, "h w"]]:
    """Depth and label of every pixel.

    What is as far as the ground alone would be is ground, or stone by the same token; what is nearer than both was
    strewn on it. About one ray in a hundred thousand slips through between two triangles of the ground: pixels of sky
    are looked at again NUDGE beside their centres.
    """
    depth, label = _seen(scene, camera)
    sky = label == SKY
    if sky.any():
        nudged = replace(camera, cx=camera.cx + NUDGE, cy=camera.cy + 0.7 * NUDGE)
        for values, again in zip((depth, label), _seen(scene, nudged), strict=True):
            values[sky] = again[sky]
    return depth, label


def _seen(scene: synthetic.Scene, camera: Camera) -> tuple[Float32[Array, "h w"], Float32[Array, "h w"]]:
    depth, alone = synthetic.render_depth(scene, camera), synthetic.render_alone(scene, camera)
    nothing = np.full_like(depth, np.inf)
    ground, stones = (alone.get(name, nothing) for name in ("ground", "stones"))
    strewn = STONE if scene.family in ROCKY else PLANT
    label = np.where(stones < ground, STONE, GROUND)
    label = np.where(depth < np.minimum(ground, stones) * (1 - SAME), strewn, label)
    return depth, np.where(np.isinf(depth), SKY, label).astype(np.float32)


def write(path: Path | str, scene: synthetic.Scene, camera: Camera) -> None:
    """Write what the camera sees."""
    depth, label = seen(scene, camera)
    header = {"labels": json.dumps(LABELS), "camera": json.dumps(camera_to_json(camera))}
    image_files.write_exr(path, {"Z": depth, "label": label}, header)


def read(path: Path | str) -> tuple[Float32[Array, "h w"], Float32[Array, "h w"], Camera]:
    """Depth, label and camera of a file that `write` wrote. Raises: InputError: not readable, or of another kind."""
    channels, header = image_files.read_exr(path)
    try:
        return channels["Z"], channels["label"], camera_from_json(json.loads(header["camera"]))
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: no depth, labels and camera of a synthetic picture ({error})") from error
