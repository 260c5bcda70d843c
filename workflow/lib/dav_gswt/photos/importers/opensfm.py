"""Reader of reconstruction.json of OpenSfM and OpenDroneMap: normalised image coordinates from the picture's middle.

Lengths are in longer sides of the picture. Poses map the world to the camera. Where the file has a reference, the world
is metric: x east, y north, z up.
"""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pycolmap
from pydantic import Field
from scipy.spatial.transform import Rotation

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos.importers.checks import ImportedImage, ImportedModel, check_image_name, parse_part
from dav_gswt.photos.importers.lens_models import make_lens

_log = logging.getLogger(__name__)

# The parameters of each kind of lens, in the order of the radial terms; OpenSfM's p1 and p2 are OpenCV's.
RADIAL = {"perspective": 2, "brown": 3, "radial": 2, "simple_radial": 1}
FISHEYE = {"fisheye": 2, "fisheye_opencv": 4}
Radians = Annotated[float, Field(ge=-100, le=100)]  # a few full turns at most


@dataclass(frozen=True)
class Lens:
    """A camera of the file. focal: of kinds with one focal length and the picture's middle; else focal_x to c_y."""

    width: float
    height: float
    projection_type: str = "perspective"
    focal: float | None = None
    focal_x: float | None = None
    focal_y: float | None = None
    c_x: float = 0.0
    c_y: float = 0.0
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    p1: float = 0.0
    p2: float = 0.0


@dataclass(frozen=True)
class Shot:
    """A picture of the file. rotation: axis times angle."""

    camera: str
    rotation: tuple[Radians, Radians, Radians]
    translation: tuple[float, float, float]


@dataclass(frozen=True)
class Place:
    """Where the world's origin lies, in degrees and metres."""

    latitude: Annotated[float, Field(gt=-89.9, lt=89.9)]
    longitude: Annotated[float, Field(ge=-360, le=360)]
    altitude: Annotated[float, Field(gt=-1e5, lt=1e5)]


def import_opensfm(path: Path, values: list[dict]) -> ImportedModel:
    """The largest of the file's reconstructions. Its points are not read, as the file does not say
    who sees them.

    Raises: InputError: with file, camera or shot, and key.
    """
    parts = [part for part in values if isinstance(part, dict) and isinstance(part.get("shots"), dict)]
    chosen = max(parts, key=lambda part: len(part["shots"]), default={})
    if not isinstance(chosen.get("cameras"), dict):
        raise InputError(f"{path}: has no reconstruction with `shots` and `cameras`; export the file again")
    if len(parts) > 1:
        number = sum(len(part["shots"]) for part in parts) - len(chosen["shots"])
        _log.warning(
            "%s: %d images of other reconstructions are left out: they do not hang together with the largest, of %d",
            *(path, number, len(chosen["shots"])),
        )
    cameras = {key: _make_lens(said, f"{path}: camera {key[:80]!r}") for key, said in chosen["cameras"].items()}
    images = (_read_shot(name, shot, cameras, path) for name, shot in chosen["shots"].items())
    return ImportedModel(tuple(images), about=_read_georeference(chosen.get("reference_lla"), path))


def _read_georeference(values, path: Path) -> Georeference | None:
    """The place that the world's metres are counted from, if the file has one."""
    if values is None:
        return None
    place = parse_part(values, Place, f"{path}: reference_lla")
    if place.latitude == place.longitude == 0:
        _log.info("%s: 0, 0 is what OpenSfM writes of photos without GPS: no place is known", path)
        return None
    return Georeference(place.latitude, place.longitude, place.altitude, north=0.0, metres_per_unit=1.0)


def _make_lens(values, where: str) -> pycolmap.Camera:
    """The lens of a camera; a picture's point x is at the pixel x m + width / 2, where m is the longer side."""
    said = parse_part(values, Lens, where)
    kind = said.projection_type
    if kind not in (*RADIAL, *FISHEYE):
        known = ", ".join((*RADIAL, *FISHEYE))
        raise InputError(
            f"{where}: projection_type {kind[:40]} is not read, only {known}; cut panoramas into perspective "
            "pictures, or choose another camera type for the reconstruction"
        )
    one = kind in ("perspective", "fisheye")  # focal length, and nothing said of the principal point
    fx, fy, cx, cy = (said.focal, said.focal, 0.0, 0.0) if one else (said.focal_x, said.focal_y, said.c_x, said.c_y)
    if fx is None or fy is None:
        raise InputError(f"{where}: its focal length is missing; export the file again")
    width, height = round(said.width), round(said.height)
    side = max(width, height)
    pinhole = (fx * side, fy * side, cx * side + width / 2, cy * side + height / 2)
    k = (said.k1, said.k2, said.k3, said.k4)[: (RADIAL | FISHEYE)[kind]]
    p = (said.p1, said.p2) if kind == "brown" else ()
    return make_lens((width, height), pinhole, k, p, kind in FISHEYE, where)


def _read_shot(label: str, values, cameras: dict[str, pycolmap.Camera], path: Path) -> ImportedImage:
    name = check_image_name(label, str(path))
    where = f"{path}: shot {name}"
    shot = parse_part(values, Shot, where)
    if shot.camera not in cameras:
        raise InputError(f"{where}: there is no camera {shot.camera[:80]!r}; export the file again")
    rotation = Rotation.from_rotvec(shot.rotation).as_matrix()
    return ImportedImage(name, cameras[shot.camera], rotation, np.array(shot.translation))
