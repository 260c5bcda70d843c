"""The interface of a generative prior: it samples several possible pictures of a view, given what is known of it.

Known are the field rendered at the pose, and the nearest photo. Training and scoring share this code.
"""

from dataclasses import dataclass, fields, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, Rows
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose, pose_of_camera, pose_offset
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import Rendering, make_rasterizer, to_raster_arrays

SUPERSAMPLING = 2  # renders are this many times larger and averaged: edges are soft, as in a photo made smaller
LEAST_ALPHA = 0.05  # a pixel of less opacity has no depth


@dataclass(frozen=True)
class Condition(Rows):
    """What is known of b views, of s x s pixels each; colours sRGB in [0, 1].

    colour, alpha: the field rendered at the pose, colour over black. inverse_depth: flying height over depth, 0 where
    the render is empty. photo: the captured photo nearest to the pose. relative: the pose relative to that photo:
    difference of elevation in radians, sine and cosine of the difference of azimuth, difference of radius over the
    flying height.
    """

    colour: Float32[Array, "b s s 3"]
    alpha: Float32[Array, "b s s"]
    inverse_depth: Float32[Array, "b s s"]
    photo: Float32[Array, "b s s 3"]
    relative: Float32[Array, "b 4"]

    def check(self) -> None:
        """Raises: ValueError: a value is not finite; the message names the array and the first such view."""
        for f in fields(self):
            values = getattr(self, f.name)
            good = np.isfinite(values).reshape(len(self), -1).all(1)
            if not good.all():
                raise ValueError(f"{f.name} of view {int(np.argmin(good))} is not finite")


@runtime_checkable
class Prior(Protocol):
    """A generative model of views. name: as in the config. size: pixels per side of its pictures.

    small: so small that every thread can have a copy of its own.
    """

    name: str
    size: int
    small: bool

    def sample(
        self, condition: Condition, m: int, p_drop: float, steps: int, seed: int, common: bool = True
    ) -> Float32[Array, "b m c hz wz"]:
        """Draw m latents of each view by DDIM with eta = 0, each under an attention dropout mask of its own.

        One mask holds for a whole trajectory. p_drop = 0 with common noise gives m equal latents, to the bit. The
        latents of a view do not depend on its batch (to 1e-5).

        Args:    common: all samples start from one noise and differ by dropout alone. False: each of the m samples
                 starts from a noise of its own, the same for every view.
        Raises:  ValueError: m < 1, steps < 1, or p_drop outside [0, 1).
        """
        ...

    def decode(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n s s 4"]:
        """The pictures of latents: colours over black, and opacity."""
        ...


@dataclass(frozen=True)
class RenderedView:
    """A field rendered at a pose; colour over black, inverse depth as in Condition."""

    colour: Float32[Array, "h w 3"]
    alpha: Float32[Array, "h w"]
    inverse_depth: Float32[Array, "h w"]


@dataclass(frozen=True)
class ReferencePhotos:
    """The photos captured so far: their poses, and their centre squares at the size of the prior."""

    poses: list[Pose]
    photos: Float32[Array, "n s s 3"]


def prepare_photos(views: list[TrainingView], frame: SceneFrame, size: int) -> ReferencePhotos:
    """Crop and resize captured photos of any size for a prior of `size` pixels."""
    small = [_resize(crop_image(view.image), size) for view in views]
    return ReferencePhotos([pose_of_camera(view.name, view.camera, frame) for view in views], np.stack(small))


def _resize(square: Float32[Array, "s s 3"], size: int) -> Float32[Array, "{size} {size} 3"]:
    if len(square) >= size:
        return image_files.shrink_image(square, size, size)
    return np.stack([image_files.enlarge_map(square[..., c], size, size) for c in range(3)], -1)


def build_condition(
    field: GaussianField, poses: list[tuple[Pose, Camera]], known: ReferencePhotos, flying_height: float, size: int
) -> Condition:
    """The condition of every pose, at size x size pixels of the centre square of its picture."""
    renders = render_views(field, [crop_camera(camera).resized(size, size) for _, camera in poses], flying_height)
    at = [find_nearest(pose, known.poses) for pose, _ in poses]
    relative = [relative_pose(known.poses[i], pose, flying_height) for i, (pose, _) in zip(at, poses, strict=True)]
    return Condition(
        np.stack([r.colour for r in renders]),
        np.stack([r.alpha for r in renders]),
        np.stack([r.inverse_depth for r in renders]),
        known.photos[at],
        np.stack(relative),
    )


def render_view(field: GaussianField, camera: Camera, flying_height: float) -> RenderedView:
    """Render the field's part of a Condition."""
    return render_views(field, [camera], flying_height)[0]


def render_views(field: GaussianField, cameras: list[Camera], flying_height: float) -> list[RenderedView]:
    """Render the field's part of Conditions. Everything that queries a prior renders fields by this function."""
    large = [camera.resized(SUPERSAMPLING * camera.width, SUPERSAMPLING * camera.height) for camera in cameras]
    renders = make_rasterizer().forward_each(to_raster_arrays(field), large)
    return [_shrink_render(render, flying_height) for render in renders]


def _shrink_render(render: Rendering, flying_height: float) -> RenderedView:
    colour, alpha, depth = (_downsample(a) for a in (render.colour, render.alpha, render.depth))
    solid = alpha > LEAST_ALPHA
    inverse = np.where(solid, flying_height * alpha / np.where(solid, depth, 1), 0)
    return RenderedView(np.clip(colour, 0, 1), np.clip(alpha, 0, 1), inverse.astype(np.float32))


def _downsample(image: Float32[Array, "h w *c"]) -> Float32[Array, "h2 w2 *c"]:
    """Mean over blocks of SUPERSAMPLING x SUPERSAMPLING pixels."""
    h, w, *rest = image.shape
    blocks = image.reshape(h // SUPERSAMPLING, SUPERSAMPLING, w // SUPERSAMPLING, SUPERSAMPLING, *rest)
    return blocks.mean((1, 3), dtype=np.float32)


def find_nearest(pose: Pose, references: list[Pose]) -> int:
    """The index of the reference pose nearest to a pose."""
    return int(np.argmin([np.linalg.norm(pose_offset(r) - pose_offset(pose)) for r in references]))


def relative_pose(photo: Pose, pose: Pose, flying_height: float) -> Float32[Array, "4"]:
    """A pose relative to that of a photo, see `Condition`."""
    turn = np.radians(pose.azimuth - photo.azimuth)
    rise = np.radians(pose.elevation - photo.elevation)
    farther = (pose.radius - photo.radius) / flying_height
    return np.array([rise, np.sin(turn), np.cos(turn), farther], np.float32)


def crop_camera(camera: Camera) -> Camera:
    """The camera of the centre square of a camera's picture."""
    side = min(camera.width, camera.height)
    left, top = (camera.width - side) // 2, (camera.height - side) // 2
    return replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=side, height=side)


def crop_image(image: Float32[Array, "h w c"]) -> Float32[Array, "s s c"]:
    """The centre square of a picture, as `crop_camera` sees it."""
    h, w = image.shape[:2]
    side = min(h, w)
    left, top = (w - side) // 2, (h - side) // 2
    return np.ascontiguousarray(image[top : top + side, left : left + side])
