"""What a prior is told of a candidate pose: the field as it shows there, and the nearest photo taken so far."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import images
from dav_gswt.active import poses
from dav_gswt.active.candidates import Candidates
from dav_gswt.active.poses import Pose
from dav_gswt.cameras import Camera
from dav_gswt.field import Field
from dav_gswt.prior.examples import nearest, relative, shown
from dav_gswt.prior.interface import Condition
from dav_gswt.views import View


@dataclass(frozen=True)
class Taken:
    """The photos taken so far, as priors see them: where from, and their middle squares at the prior's size."""

    places: list[Pose]
    photos: Float32[Array, "n s s 3"]


def taken(views: list[View], frame: dict, size: int) -> Taken:
    """Of photos at any size."""
    small = [_sized(middle_square(view.image), size) for view in views]
    return Taken([poses.of_camera(view.name, view.camera, frame) for view in views], np.stack(small))


def _sized(square: Float32[Array, "s s 3"], size: int) -> Float32[Array, "{size} {size} 3"]:
    if len(square) >= size:
        return images.resized(square, size, size)
    return np.stack([images.enlarged(square[..., c], size, size) for c in range(3)], -1)


def condition(field: Field, pool: Candidates, known: Taken, flying_height: float, size: int) -> Condition:
    """The condition of every candidate, at size x size pixels of the middle square of its picture."""
    seen = [shown(field, squared(camera).resized(size, size), flying_height) for _, camera in pool]
    at = [nearest(pose, known.places) for pose, _ in pool]
    apart = [relative(known.places[i], pose, flying_height) for i, (pose, _) in zip(at, pool, strict=True)]
    parts = ([getattr(s, name) for s in seen] for name in ("colour", "alpha", "inverse_depth"))
    return Condition(*(np.stack(p) for p in parts), known.photos[at], np.stack(apart))


def squared(camera: Camera) -> Camera:
    """The camera of the middle square of a camera's picture."""
    side = min(camera.width, camera.height)
    left, top = (camera.width - side) // 2, (camera.height - side) // 2
    return replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=side, height=side)


def middle_square(image: Float32[Array, "h w c"]) -> Float32[Array, "s s c"]:
    """What `squared` sees of a picture."""
    h, w = image.shape[:2]
    side = min(h, w)
    left, top = (w - side) // 2, (h - side) // 2
    return np.ascontiguousarray(image[top : top + side, left : left + side])
