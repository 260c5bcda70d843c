"""What a prior is told of a view: the field as it shows there, and the nearest photo taken so far.

The same for the examples that it learns from and for the poses that are scored.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import poses
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import View
from dav_gswt.prior.interface import Condition
from dav_gswt.raster import Rasterizer, to_raster_arrays

FINE = 2  # pictures are drawn so many times as large and averaged: edges are soft, as in a photo made smaller
CLEAR = 0.05  # opacity below which a pixel has no depth


@dataclass(frozen=True)
class Shown:
    """A field seen from a pose; colours over black, inverse depth as in Condition."""

    colour: Float32[Array, "h w 3"]
    alpha: Float32[Array, "h w"]
    inverse_depth: Float32[Array, "h w"]


@dataclass(frozen=True)
class Taken:
    """The photos taken so far, as priors see them: where from, and their middle squares at the prior's size."""

    places: list[Pose]
    photos: Float32[Array, "n s s 3"]


def taken(views: list[View], frame: SceneFrame, size: int) -> Taken:
    """Of photos at any size."""
    small = [_sized(middle_square(view.image), size) for view in views]
    return Taken([poses.of_camera(view.name, view.camera, frame) for view in views], np.stack(small))


def _sized(square: Float32[Array, "s s 3"], size: int) -> Float32[Array, "{size} {size} 3"]:
    if len(square) >= size:
        return image_files.shrink_image(square, size, size)
    return np.stack([image_files.enlarge_map(square[..., c], size, size) for c in range(3)], -1)


def condition(
    field: GaussianField, pool: list[tuple[Pose, Camera]], known: Taken, flying_height: float, size: int
) -> Condition:
    """The condition of every candidate, at size x size pixels of the middle square of its picture."""
    seen = [shown(field, squared(camera).resized(size, size), flying_height) for _, camera in pool]
    at = [nearest(pose, known.places) for pose, _ in pool]
    apart = [relative(known.places[i], pose, flying_height) for i, (pose, _) in zip(at, pool, strict=True)]
    parts = ([getattr(s, name) for s in seen] for name in ("colour", "alpha", "inverse_depth"))
    return Condition(*(np.stack(p) for p in parts), known.photos[at], np.stack(apart))


def shown(field: GaussianField, camera: Camera, flying_height: float) -> Shown:
    """What a field shows to a camera: the field's part of a Condition. All that asks a prior draws fields with this."""
    large = camera.resized(FINE * camera.width, FINE * camera.height)
    seen = Rasterizer().forward(**to_raster_arrays(field), camera=large)
    colour, alpha, depth = (pooled(a) for a in (seen.colour, seen.alpha, seen.depth))
    there = alpha > CLEAR
    inverse = np.where(there, flying_height * alpha / np.where(there, depth, 1), 0)
    return Shown(np.clip(colour, 0, 1), np.clip(alpha, 0, 1), inverse.astype(np.float32))


def pooled(image: Float32[Array, "h w *c"]) -> Float32[Array, "h2 w2 *c"]:
    """Mean over blocks of FINE x FINE pixels."""
    h, w, *rest = image.shape
    return image.reshape(h // FINE, FINE, w // FINE, FINE, *rest).mean((1, 3), dtype=np.float32)


def nearest(pose: Pose, places: list[Pose]) -> int:
    """Which of the places is nearest to the pose."""
    return int(np.argmin([np.linalg.norm(poses.place(p) - poses.place(pose)) for p in places]))


def relative(photo: Pose, pose: Pose, flying_height: float) -> Float32[Array, "4"]:
    """From a photo to a pose, as a Condition has it."""
    turn = np.radians(pose.azimuth - photo.azimuth)
    rise = np.radians(pose.elevation - photo.elevation)
    return np.float32([rise, np.sin(turn), np.cos(turn), (pose.radius - photo.radius) / flying_height])


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
