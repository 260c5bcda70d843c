"""Camera models that exist already: taken as they are, instead of structure from motion.

`read` takes a folder of COLMAP's, a transforms.json (nerfstudio, instant-ngp) or a reconstruction.json (OpenSfM,
OpenDroneMap), and returns what `sfm.register` does. Positions stay in the world that the model gives, metric if it is.
"""

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.importers import checks, colmap, lens_models, nerfstudio, opensfm, points, undistortion
from dav_gswt.photos.importers.imported_model import Given
from dav_gswt.photos.importers.points import Seen
from dav_gswt.photos.importers.undistortion import Placed
from dav_gswt.photos.model import Model
from dav_gswt.photos.sfm.gps import Positions
from dav_gswt.photos.sfm.registration import LEAST_PHOTOS, Options, Registered

__all__ = ["read"]

_log = logging.getLogger(__name__)

MOST_LOOSE = 50_000  # points that no image is known to see


def read(path: Path | str, folder: Path | str, options: Options) -> Registered:
    """The photos of a folder with the cameras of a model.

    A photo belongs to the image of the same name: the path below the folder, else the file name, else the stem. It may
    be a scaled copy. Where the model says who sees which point, these are its points; else they are triangulated from
    features under the given cameras, and points that the model gives without observations follow as they are, for they
    tell where ground is.
    Raises: InputError: not a model, damaged, one that is not read, or fewer than three photos have a camera in it.
    """
    path, photos = Path(path), undistortion.Folder(Path(folder))
    given = _given(path, photos)
    placed, left_out = undistortion.placed(given, photos, path)
    if len(placed) < LEAST_PHOTOS:
        raise InputError(
            f"{path}: {len(placed)} of its {len(given.shots)} images have a photo in {folder}; at least {LEAST_PHOTOS} "
            "are needed: give the folder of the photos that the model was made of, under the same names"
        )
    for name, reason in left_out:
        _log.warning("%s is left out: %s", name, reason)
    seen = points.observed(given, placed) if len(given.point_of) else points.triangulated(placed, options)
    pairs = _pinholes(placed, options.side, path)
    model = _model(placed, [pinhole for _, pinhole in pairs], seen)
    if not len(model.points):
        raise InputError(
            f"{path}: under its cameras the photos share no point; either they are not those that the model was made "
            "of, or they show too little texture"
        )
    if not len(given.point_of):
        model = _with_loose(model, *_thinned(given.points, given.colours, placed))
    centres = np.stack([camera.centre for camera in model.cameras])
    return Registered(
        model=model,
        sources=tuple(p.path for p in placed),
        lenses=tuple(lens for lens, _ in pairs),
        left_out=left_out,
        focal=None,
        error=seen.error,
        positions=Positions(given.about, centres) if given.about else None,
    )


def _given(path: Path, photos: undistortion.Folder) -> Given:
    """What a file says, whichever kind it is of."""
    if path.is_dir():
        if model := colmap.found(path):
            return colmap.read(model, photos.folder)
        raise InputError(
            f"{path}: no COLMAP model in this folder (cameras and images, as .bin or .txt); of other programs name the "
            "file itself, transforms.json or reconstruction.json"
        )
    values = checks.read_json(path)
    if isinstance(values, dict) and "frames" in values:
        return nerfstudio.read(path, values, photos.folder, photos.stored_size)
    if isinstance(values, list) and values and isinstance(values[0], dict) and "shots" in values[0]:
        return opensfm.read(path, values, photos.folder)
    raise InputError(
        f"{path}: neither a transforms.json (an object with `frames`) nor a reconstruction.json (a list of objects "
        "with `shots`); name one of these, or a folder of COLMAP's"
    )


def _pinholes(placed: Sequence[Placed], side: int, path: Path) -> list[tuple[pycolmap.Camera, pycolmap.Camera]]:
    """Of each photo the lens at the size of its picture, and the pinhole camera of that; equal lenses share one."""
    made = {}
    for place in placed:
        if (key := lens_models.key(place.lens)) not in made:
            made[key] = lens_models.pinhole(place.lens, side, f"{path}: {place.path.name}")
    return [made[lens_models.key(place.lens)] for place in placed]


def _model(placed: Sequence[Placed], pinholes: list[pycolmap.Camera], seen: Seen) -> Model:
    """Pinhole cameras, and the observations that fall into their pictures; points that have none are left out."""
    focal, middle, size = (
        np.array(column, float)
        for column in zip(*((p.params[:2], p.params[2:], (p.width, p.height)) for p in pinholes), strict=True)
    )
    own = seen.image_of
    pixels = seen.rays * focal[own] + middle[own]
    with np.errstate(invalid="ignore"):
        inside = (pixels >= 0).all(1) & (pixels <= size[own]).all(1)
    kept = points.only(seen, inside)
    order = np.lexsort((kept.image_of, kept.point_of))
    cameras = (
        Camera(p.rotation, p.translation, *map(float, h.params), h.width, h.height)
        for p, h in zip(placed, pinholes, strict=True)
    )
    names = tuple(p.key for p in placed)
    return Model(
        names,
        tuple(cameras),
        kept.points,
        kept.colours,
        kept.point_of[order],
        kept.image_of[order],
        pixels[inside][order],
    )


def _thinned(
    places: Float[Array, "n 3"], colours: Float32[Array, "n 3"], placed: Sequence[Placed]
) -> tuple[Float[Array, "k 3"], Float32[Array, "k 3"]]:
    """The points that lie in two photos or more, every n-th where there are many."""
    step = -(-len(places) // MOST_LOOSE) or 1
    places, colours = places[::step], colours[::step]
    count = np.zeros(len(places), int)
    for place in placed:
        count += points.sees(place.lens, place.rotation, place.translation, places)
    if len(places) and (count < 2).mean() > 0.5:
        _log.warning("%d of the model's %d points lie in no two photos", int((count < 2).sum()), len(places))
    return places[count >= 2], colours[count >= 2]


def _with_loose(model: Model, places: Float[Array, "k 3"], colours: Float32[Array, "k 3"]) -> Model:
    """The model and further points that nothing observes."""
    return Model(
        model.names,
        model.cameras,
        np.concatenate([model.points, places]),
        np.concatenate([model.colours, colours]),
        model.point_of,
        model.image_of,
        model.pixels,
    )
