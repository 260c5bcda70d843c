"""Imported models, and checks of the untrusted files that they come from.

Sizes, finite numbers, proper rotations, and names of pictures are checked. Errors
name the file, and the key or image within it.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import TypeVar

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import parse_record
from dav_gswt.geometry.georeference import Georeference

Record = TypeVar("Record")

LARGEST_JSON = 1 << 28  # bytes; as Python objects a file takes about ten times its size
LARGEST = 1 << 31  # bytes of any other file
LONGEST_NAME = 1024
ORTHONORMAL = 1e-3  # greatest entry of R R^T - I: files with few digits pass, sheared and scaled axes do not
_DRIVE = re.compile(r"^[A-Za-z]:")


@dataclass(frozen=True)
class ImportedImage:
    """One image of a model. A world point p has camera coordinates rotation @ p + translation (x
    right, y down).

    name: a path with slashes, whose end is a photo's. lens: at the size that the model gives, of the picture as it is
    stored. number: of the image among the model's points.
    """

    name: str
    lens: pycolmap.Camera
    rotation: Float[Array, "3 3"]
    translation: Float[Array, "3"]
    number: int = 0


@dataclass(frozen=True)
class ImportedModel:
    """The images of a model. points: what the file says of points and of the images that see them, if anything.

    about: the place of the world's origin, if the world is known to be in metres east, north and up.
    """

    images: tuple[ImportedImage, ...]
    points: pycolmap.Reconstruction = field(default_factory=pycolmap.Reconstruction)
    about: Georeference | None = None


def check_size(path: Path, most: int) -> None:
    """Raises: InputError: there is no such file, or it is larger than `most` bytes."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    if (size := path.stat().st_size) > most:
        raise InputError(f"{path}: {size} bytes; at most {most} are read: leave out images, or points, in the export")


def parse_part(values, kind: type[Record], where: str) -> Record:
    """A part of a file as a dataclass. Raises: InputError: a value is missing or of another type."""
    try:
        return parse_record(values, kind)
    except ValueError as error:
        raise InputError(f"{where}: {error}; correct it or export the file again") from error


def check_pose(pose: Float[Array, "3 4"], where: str) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Rotation and translation; the rotation is the nearest to a matrix that is one but for rounding.

    Raises: InputError: sheared, scaled, mirrored or not finite.
    """
    matrix = pose[:, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if not off <= ORTHONORMAL or np.linalg.det(matrix) < 0:
        raise InputError(
            f"{where}: its rotation is none (R R^T differs from 1 by {off:.2g}, or it mirrors); export poses that are "
            "rigid, without scale or shear"
        )
    if not np.isfinite(pose).all():
        raise InputError(f"{where}: a number of its position is not finite; remove that entry or export it again")
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt, pose[:, 3].copy()


def check_image_name(value: str, where: str) -> str:
    """The name of an image, with slashes: a path of whatever machine without its drive, root and steps upwards.

    Photos are found by such a name among those of the folder (`PhotoFolder.find`); it is never opened.
    Raises: InputError: it is no name.
    """
    plain = _DRIVE.sub("", value.replace("\\", "/"))
    kept = [part for part in PurePosixPath(plain).parts if part not in ("/", "//", "..")]
    if not "".join(kept).strip() or len(value) > LONGEST_NAME or not value.isprintable():
        raise InputError(f"{where}: {value[:80]!r} is no name of a picture; write its path below the photos' folder")
    return "/".join(kept)
