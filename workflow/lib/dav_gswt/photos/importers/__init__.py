"""Import of camera models, which take the place of structure from motion.

`import_model` takes a folder of COLMAP, a transforms.json (nerfstudio, instant-ngp) or a
reconstruction.json (OpenSfM, OpenDroneMap), and returns a `Registration`. Positions stay in the
world of the model. A further format needs a reader that returns an `ImportedModel`, and a line in
`_read_model`.
"""

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.photos.importers.checks import ImportedModel, read_untrusted_json
from dav_gswt.photos.importers.colmap import find_colmap_folder, import_colmap
from dav_gswt.photos.importers.lens_models import camera_key, undistort_camera
from dav_gswt.photos.importers.nerfstudio import import_nerfstudio
from dav_gswt.photos.importers.opensfm import import_opensfm
from dav_gswt.photos.importers.photo_matching import MatchedPhoto, PhotoFolder, match_photos_to_images
from dav_gswt.photos.importers.points import Observations, collect_observations, triangulate_features
from dav_gswt.photos.sfm.gps import GpsPositions
from dav_gswt.photos.sfm.mapping import LEAST_PHOTOS
from dav_gswt.photos.sfm.registration import Registration, SfmOptions

__all__ = ["import_model"]

_log = logging.getLogger(__name__)


def import_model(path: Path | str, folder: Path | str, options: SfmOptions) -> Registration:
    """The photos of a folder with the cameras of a model.

    A photo belongs to the image of the same name: the path below the folder, else the stem. It may
    be a scaled copy. The points are those of the model if it says which image
    sees them. Otherwise they are triangulated from features under the given cameras.
    Raises: InputError: not a model, damaged, one that is not read, or fewer than three photos have a camera in it.
    """
    path, photos = Path(path), PhotoFolder(Path(folder))
    given = _read_model(path, photos)
    placed, left_out = match_photos_to_images(given, photos, path)
    if len(placed) < LEAST_PHOTOS:
        raise InputError(
            f"{path}: {len(placed)} of its {len(given.shots)} images have a photo in {folder}; at least {LEAST_PHOTOS} "
            "are needed: give the folder of the photos that the model was made of, under the same names"
        )
    for name, reason in left_out:
        _log.warning("%s is left out: %s", name, reason)
    seen = collect_observations(given, placed) if len(given.point_of) else triangulate_features(placed, options)
    made: dict[tuple, tuple[pycolmap.Camera, pycolmap.Camera]] = {}  # lens and pinhole at picture size
    for place in placed:
        if (key := camera_key(place.lens)) not in made:
            made[key] = undistort_camera(place.lens, options.side, f"{path}: {place.path.name}")
    pairs = [made[camera_key(place.lens)] for place in placed]
    model = _make_sparse_model(placed, [pinhole for _, pinhole in pairs], seen)
    if not len(model.points):
        raise InputError(
            f"{path}: under its cameras the photos share no point; either they are not those that the model was made "
            "of, or they show too little texture"
        )
    centres = np.stack([camera.centre for camera in model.cameras])
    return Registration(
        model=model,
        sources=tuple(p.path for p in placed),
        lenses=tuple(lens for lens, _ in pairs),
        left_out=left_out,
        focal=None,
        error=seen.error,
        positions=GpsPositions(given.about, centres) if given.about else None,
    )


def _read_model(path: Path, photos: PhotoFolder) -> ImportedModel:
    """What a file says, whichever kind it is of."""
    if path.is_dir():
        if model := find_colmap_folder(path):
            return import_colmap(model, photos.folder)
        raise InputError(
            f"{path}: no COLMAP model in this folder (cameras and images, as .bin or .txt); of other programs name the "
            "file itself, transforms.json or reconstruction.json"
        )
    values = read_untrusted_json(path)
    if isinstance(values, dict) and "frames" in values:
        return import_nerfstudio(path, values, photos.folder, photos.stored_size)
    if isinstance(values, list) and values and isinstance(values[0], dict) and "shots" in values[0]:
        return import_opensfm(path, values, photos.folder)
    raise InputError(
        f"{path}: neither a transforms.json (an object with `frames`) nor a reconstruction.json (a list of objects "
        "with `shots`); name one of these, or a folder of COLMAP's"
    )


def _make_sparse_model(
    placed: Sequence[MatchedPhoto], pinholes: list[pycolmap.Camera], seen: Observations
) -> ColmapModel:
    """Pinhole cameras, and the observations that fall into their pictures; points that have none are left out."""
    focal, middle, size = (
        np.array(column, float)
        for column in zip(*((p.params[:2], p.params[2:], (p.width, p.height)) for p in pinholes), strict=True)
    )
    pixels = seen.rays * focal[seen.image_of] + middle[seen.image_of]
    with np.errstate(invalid="ignore"):
        inside = np.asarray((pixels >= 0).all(1) & (pixels <= size[seen.image_of]).all(1))
    order = np.flatnonzero(inside)
    order = order[np.lexsort((seen.image_of[order], seen.point_of[order]))]
    own, point_of = np.unique(seen.point_of[order], return_inverse=True)
    cameras = (
        Camera(p.rotation, p.translation, fx, fy, cx, cy, h.width, h.height)
        for p, h in zip(placed, pinholes, strict=True)
        for fx, fy, cx, cy in [h.params.tolist()]
    )
    return ColmapModel(
        tuple(p.key for p in placed),
        tuple(cameras),
        seen.points[own],
        seen.colours[own],
        point_of,
        seen.image_of[order],
        pixels[order],
    )
