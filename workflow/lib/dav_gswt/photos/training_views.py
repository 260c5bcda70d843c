"""Training views: a photo with its camera at the size of a preset, and a weight per pixel for the fit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import read_capture_record

WHOLE = 0.99  # of a shrunk pixel that must not be masked for it to count


@dataclass(frozen=True)
class TrainingView:
    """A photo and its camera on the same pixel grid.

    weight: 1 where the photo counts, 0 where it is not fitted. behind: the colour behind all that can be modelled, NaN
    where that is not known; None: nowhere.
    """

    name: str
    camera: Camera
    image: Float32[Array, "h w 3"]
    weight: Float32[Array, "h w"]
    behind: Float32[Array, "h w 3"] | None = None


def make_training_view(
    name: str,
    camera: Camera,
    image: Float32[Array, "h w 3"],
    size: int,
    cover: Float32[Array, "h w"] | None = None,
) -> TrainingView:
    """A view at most `size` pixels wide or high; photos are never enlarged. cover: 0 where the photo is masked."""
    share = min(1.0, size / max(camera.width, camera.height))
    width, height = max(1, round(camera.width * share)), max(1, round(camera.height * share))
    if (width, height) != (camera.width, camera.height):
        image, camera = image_files.shrink_image(image, width, height), camera.resized(width, height)
        cover = cover if cover is None else image_files.shrink_image(cover[..., None], width, height)[..., 0]
    weight = np.ones(image.shape[:2]) if cover is None else cover > WHOLE
    return TrainingView(name, camera, image, weight.astype(np.float32))


def read_training_view(name: str, camera: Camera, path: Path | str, size: int) -> TrainingView:
    """The view of a picture file; what its alpha masks does not count.

    Raises: InputError: not readable as an image, or smaller than the camera's picture.
    """
    image, cover = image_files.read_photo_and_alpha(path)
    if image.shape[0] < camera.height or image.shape[1] < camera.width:
        raise InputError(
            f"{path}: {image.shape[1]} x {image.shape[0]} pixels, its camera takes {camera.width} x {camera.height}; "
            "make the photos again"
        )
    return make_training_view(name, camera, image, size, cover)


def read_captured_views(folder: Path | str, size: int) -> list[TrainingView]:
    """The photos that one round's capture/ folder holds, in the order they were taken.

    Raises: InputError: see `read_capture_record`.
    """
    folder = Path(folder)
    return [read_training_view(p.name, p.camera, folder / p.name, size) for p in read_capture_record(folder)]


def mask_outside_ground(view: TrainingView, west: float, south: float, east: float, north: float) -> TrainingView:
    """The view with weight 0 where its ray does not meet the plane z = 0 inside the rectangle."""
    origin, step = view.camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -origin[..., 2] / step[..., 2]
        x, y = origin[..., 0] + t * step[..., 0], origin[..., 1] + t * step[..., 1]
    hit = (t > 0) & (x > west) & (x < east) & (y > south) & (y < north)
    return replace(view, weight=view.weight * hit.astype(np.float32))


def read_training_views(
    images_folder: Path | str, model: Path | str, names: Sequence[str], captures: list, size: int
) -> list[TrainingView]:
    """The photos captured so far: those named in the model, then every capture folder's, in their order."""
    from dav_gswt.photos.colmap_model import read_colmap_model  # not above: it loads pycolmap

    known = read_colmap_model(model)
    start = [read_training_view(name, known.camera(name), Path(images_folder) / name, size) for name in names]
    return start + [view for folder in captures for view in read_captured_views(folder, size)]
