"""Reader of reconstruction.json of OpenSfM and OpenDroneMap: normalised image coordinates from the picture's middle.

Lengths are in longer sides of the picture. Poses map the world to the camera. Where the file has a reference, the world
is metric: x east, y north, z up.
"""

import logging
from pathlib import Path

import numpy as np
import pycolmap
from scipy.spatial.transform import Rotation

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos.importers.checks import (
    ImportedImage,
    ImportedModel,
    check_distinct,
    check_entry,
    check_image_name,
    check_number,
    check_numbers,
)
from dav_gswt.photos.importers.lens_models import make_fisheye_camera, make_perspective_camera

_log = logging.getLogger(__name__)

# The parameters of each kind of lens, in the order of the radial terms; OpenSfM's p1 and p2 are OpenCV's.
RADIAL = {"perspective": 2, "brown": 3, "radial": 2, "simple_radial": 1}
FISHEYE = {"fisheye": 2, "fisheye_opencv": 4}
_ONE_FOCAL = ("perspective", "fisheye")


def import_opensfm(path: Path, values: list, photos: Path) -> ImportedModel:
    """The largest of the file's reconstructions. Its points are not read, as the file does not say
    who sees them.

    Raises: InputError: with file, camera or shot, and key.
    """
    for i, part in enumerate(values):
        check_entry(part, "shots", dict, f"{path}: reconstruction {i}")
    best = max(range(len(values)), key=lambda i: len(values[i]["shots"]))
    for i, part in enumerate(values):
        if i != best:
            _log.warning(
                "%s: reconstruction %d with %d images is left out: it does not hang together with the largest, of %d",
                *(path, i, len(part["shots"]), len(values[best]["shots"])),
            )
    chosen = values[best]
    cameras = {
        key: _lens(camera, f"{path}: camera {key[:80]!r}")
        for key, camera in check_entry(chosen, "cameras", dict, str(path)).items()
    }
    shots = tuple(_read_shot(name, shot, cameras, photos, path) for name, shot in chosen["shots"].items())
    check_distinct([s.name for s in shots], str(path))
    return ImportedModel(shots, about=_read_georeference(chosen, path))


def _read_georeference(chosen: dict, path: Path) -> Georeference | None:
    """The place that the world's metres are counted from, if the file has one."""
    if chosen.get("reference_lla") is None:
        return None
    where = f"{path}: reference_lla"
    place = check_entry(chosen, "reference_lla", dict, str(path))
    latitude, longitude, altitude = (
        check_number(place.get(key), f"{where}: {key}") for key in ("latitude", "longitude", "altitude")
    )
    if not (abs(latitude) < 89.9 and abs(longitude) <= 360 and abs(altitude) < 1e5):
        raise InputError(f"{where}: {latitude:g}, {longitude:g}, {altitude:g} is no place on earth; correct it")
    if latitude == longitude == 0:
        _log.info("%s: 0, 0 is what OpenSfM writes of photos without GPS: no place is known", where)
        return None
    return Georeference(latitude, longitude, altitude, north=0.0, metres_per_unit=1.0)


def _lens(camera, where: str) -> pycolmap.Camera:
    """The lens of a camera; a picture's point x is at the pixel x m + width / 2, where m is the longer side."""
    if not isinstance(camera, dict):
        raise InputError(f"{where} is no object; export the file again")
    kind = camera.get("projection_type", "perspective")
    if kind not in (*RADIAL, *FISHEYE):
        known = ", ".join((*RADIAL, *FISHEYE))
        raise InputError(
            f"{where}: projection_type {str(kind)[:40]} is not read, only {known}; cut panoramas into perspective "
            "pictures, or choose another camera type for the reconstruction"
        )

    def read_value(key: str, default: float | None = None) -> float:
        if default is None and key not in camera:
            raise InputError(f"{where}: {key} is missing; export the file again")
        return check_number(camera.get(key, default), f"{where}: {key}")

    width, height = (round(read_value(key)) for key in ("width", "height"))
    side = max(width, height)
    fx, fy = (read_value("focal"),) * 2 if kind in _ONE_FOCAL else (read_value("focal_x"), read_value("focal_y"))
    cx, cy = (0.0, 0.0) if kind in _ONE_FOCAL else (read_value("c_x", 0.0), read_value("c_y", 0.0))
    pinhole = (fx * side, fy * side, cx * side + width / 2, cy * side + height / 2)
    k = tuple(read_value(f"k{i + 1}", 0.0) for i in range((RADIAL | FISHEYE)[kind]))
    if kind in FISHEYE:
        return make_fisheye_camera(width, height, pinhole, k, where)
    p = (read_value("p1", 0.0), read_value("p2", 0.0)) if kind == "brown" else ()
    return make_perspective_camera(width, height, pinhole, k, p, where)


def _read_shot(label: str, shot, cameras: dict[str, pycolmap.Camera], photos: Path, path: Path) -> ImportedImage:
    name = check_image_name(label, photos, str(path))
    where = f"{path}: shot {name}"
    camera = check_entry(shot, "camera", str, where)
    if camera not in cameras:
        raise InputError(f"{where}: there is no camera {camera[:80]!r}; export the file again")
    axis = check_numbers(check_entry(shot, "rotation", list, where), (3,), f"{where}: rotation")
    shift = check_numbers(check_entry(shot, "translation", list, where), (3,), f"{where}: translation")
    if not np.abs(axis).max() < 100:  # a few full turns at most, in radians
        raise InputError(
            f"{where}: rotation {axis.tolist()} is no axis times an angle in radians; export the file again"
        )
    return ImportedImage(name, cameras[camera], Rotation.from_rotvec(axis).as_matrix(), shift)
