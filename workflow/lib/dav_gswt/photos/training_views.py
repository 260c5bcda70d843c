"""Views: a photo with its camera, at the size at which a quality works, and the share of it that can be modelled."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.files import read_json
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files

WHOLE = 0.99  # of a shrunk pixel that must not be masked for it to count


@dataclass(frozen=True)
class View:
    """A photo and its camera on the same pixel grid.

    weight: 1 where the photo counts, 0 where it is not fitted. behind: the colour behind all that can be modelled, NaN
    where that is not known; None: nowhere.
    """

    name: str
    camera: Camera
    image: Float32[Array, "h w 3"]
    weight: Float32[Array, "h w"]
    behind: Float32[Array, "h w 3"] | None = None


def of(
    name: str,
    camera: Camera,
    image: Float32[Array, "h w 3"],
    size: int,
    cover: Float32[Array, "h w"] | None = None,
) -> View:
    """A view at most `size` pixels wide or high; photos are never enlarged. cover: 0 where the photo is masked."""
    share = min(1.0, size / max(camera.width, camera.height))
    width, height = max(1, round(camera.width * share)), max(1, round(camera.height * share))
    if (width, height) != (camera.width, camera.height):
        image, camera = image_files.shrink_image(image, width, height), camera.resized(width, height)
        cover = cover if cover is None else image_files.shrink_image(cover[..., None], width, height)[..., 0]
    weight = np.ones(image.shape[:2]) if cover is None else cover > WHOLE
    return View(name, camera, image, weight.astype(np.float32))


def read(name: str, camera: Camera, path: Path | str, size: int) -> View:
    """The view of a picture file; what its alpha masks does not count."""
    image, cover = image_files.read_photo_and_alpha(path)
    return of(name, camera, image, size, cover)


def captured(folder: Path | str, size: int) -> list[View]:
    """The photos that one round's capture/ folder holds, in the order they were taken."""
    folder = Path(folder)
    shots = read_json(folder / "capture.json")["shots"]
    return [read(s["name"], cameras.from_json(s["got"]), folder / s["name"], size) for s in shots]


def over_ground(view: View, west: float, south: float, east: float, north: float) -> View:
    """The view with weight 0 where its ray does not meet the plane z = 0 inside the rectangle."""
    origin, step = view.camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -origin[..., 2] / step[..., 2]
        x, y = origin[..., 0] + t * step[..., 0], origin[..., 1] + t * step[..., 1]
    hit = (t > 0) & (x > west) & (x < east) & (y > south) & (y < north)
    return replace(view, weight=view.weight * hit.astype(np.float32))


def taken(images_folder: Path | str, model: Path | str, names: list[str], captures: list, size: int) -> list[View]:
    """The photos captured so far: those named in the model, then every capture folder's, in their order."""
    from dav_gswt.photos import model as models  # not above: it loads pycolmap

    known = models.read(model)
    at = {name: camera for name, camera in zip(known.names, known.cameras, strict=True)}
    start = [read(name, at[name], Path(images_folder) / name, size) for name in names]
    return start + [view for folder in captures for view in captured(folder, size)]
