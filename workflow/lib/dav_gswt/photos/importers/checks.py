"""Imported models, and checks of the untrusted files that they come from.

Sizes, finite numbers, proper rotations, and names that stay in their folder are checked. Errors
name the file, and the key or image within it.
"""

import json
import math
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np
import pycolmap
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.geometry.georeference import Georeference

LARGEST_JSON = 1 << 28  # bytes; as Python objects a file takes about ten times its size
LARGEST = 1 << 31  # bytes of any other file
LONGEST_NAME = 1024
MOST_SHOTS = 20_000
ORTHONORMAL = 1e-3  # greatest entry of R R^T - I: files with few digits pass, sheared and scaled axes do not
_DRIVE = re.compile(r"^[A-Za-z]:")


@dataclass(frozen=True)
class ImportedImage:
    """One image of a model. A world point p has camera coordinates rotation @ p + translation (x
    right, y down).

    name: relative to the photos' folder, with slashes. lens: at the size that the model gives, of the picture as it is
    stored; None where no size is known because there is no such photo.
    """

    name: str
    lens: pycolmap.Camera | None
    rotation: Float[Array, "3 3"]
    translation: Float[Array, "3"]


@dataclass(frozen=True)
class ImportedModel:
    """The images of a model. If the file has observations, image image_of[k] sees point point_of[k]
    at pixels[k].

    colours: sRGB in [0, 1]. about: the place of the world's origin, if the world is known to be in
    metres east, north and up.
    """

    shots: tuple[ImportedImage, ...]
    points: Float[Array, "n 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    colours: Float32[Array, "n 3"] = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    point_of: Int[Array, "m"] = field(default_factory=lambda: np.zeros(0, int))
    image_of: Int[Array, "m"] = field(default_factory=lambda: np.zeros(0, int))
    pixels: Float[Array, "m 2"] = field(default_factory=lambda: np.zeros((0, 2)))
    about: Georeference | None = None


def check_size(path: Path, most: int) -> int:
    """The size of a file. Raises: InputError: there is none, or it is larger than `most` bytes."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    if (size := path.stat().st_size) > most:
        raise InputError(f"{path}: {size} bytes; at most {most} are read: leave out images, or points, in the export")
    return size


def read_untrusted_json(path: Path):
    """The JSON of a file, in which no object has a key twice. Raises: InputError: malformed or too large."""

    def require_unique_keys(pairs: list) -> dict:
        values = dict(pairs)
        if len(values) < len(pairs):
            twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
            raise InputError(f"{path}: the key {twice[:80]!r} is there twice; remove one")
        return values

    check_size(path, LARGEST_JSON)
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"), object_pairs_hook=require_unique_keys)
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: not readable as JSON ({summarize_error(error)}); export or copy it again") from error


def check_entry(values, key: str, kind: type, where: str):
    """The value of an object's key. Raises: InputError: no object, it is missing, or not of this kind."""
    if not isinstance(values, dict) or key not in values:
        raise InputError(f"{where}: {key} is missing; export the file again")
    if not isinstance(values[key], kind) or isinstance(values[key], bool):
        raise InputError(f"{where}: {key} is not {_KINDS[kind]}; export the file again")
    return values[key]


_KINDS = {dict: "an object", list: "a list", str: "a text"}


def check_number(value, where: str) -> float:
    """A finite number. Raises: InputError."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            if math.isfinite(found := float(value)):
                return found
        except OverflowError:  # an integer of hundreds of digits
            pass
    raise InputError(f"{where} is {str(value)[:40]!r}, which is no finite number; correct it or export the file again")


def check_numbers(values, shape: tuple[int, ...], where: str) -> Array:
    """Nested lists of finite numbers as an array. Raises: InputError: another shape, or a number that is not finite."""
    if not isinstance(values, list) or len(values) != shape[0]:
        raise InputError(f"{where} does not hold {' x '.join(map(str, shape))} numbers; export the file again")
    if len(shape) == 1:
        return np.array([check_number(v, where) for v in values])
    return np.array([check_numbers(row, shape[1:], where) for row in values])


def check_finite(values: Array, where: str) -> Array:
    """The array itself. Raises: InputError: some number in it is not finite."""
    if not np.isfinite(values).all():
        raise InputError(f"{where}: a number is not finite; remove that entry or export the file again")
    return values


def nearest_rotation(matrix: Float[Array, "3 3"], where: str) -> Float[Array, "3 3"]:
    """The rotation nearest to a matrix that is one but for rounding. Raises: InputError: sheared, scaled, mirrored."""
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if not off <= ORTHONORMAL or np.linalg.det(matrix) < 0:
        raise InputError(
            f"{where}: its rotation is none (R R^T differs from 1 by {off:.2g}, or it mirrors); export poses that are "
            "rigid, without scale or shear"
        )
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt


def check_image_name(value: str, folder: Path, where: str) -> str:
    """The name of an image, relative to the photos' folder and with slashes.

    Raises: InputError: it leads out of the folder, or is no name.
    """
    plain = value.replace("\\", "/")
    if not plain.strip("./ ") or len(plain) > LONGEST_NAME or not plain.isprintable():
        raise InputError(f"{where}: {value[:80]!r} is no name of a picture; write its path below the photos' folder")
    path = PurePosixPath(plain)
    if ".." not in path.parts and path.is_absolute() and path.is_relative_to(folder.absolute().as_posix()):
        path = path.relative_to(folder.absolute().as_posix())
    if ".." in path.parts or path.is_absolute() or _DRIVE.match(plain):
        raise InputError(
            f"{where}: {value[:80]!r} leads out of the photos' folder {folder}; write the path below it, or the file "
            "name alone"
        )
    return str(path)


def check_distinct(names: list[str], where: str) -> None:
    """Raises: InputError: a name is there twice."""
    seen = set()
    for each in names:
        if each in seen:
            raise InputError(f"{where}: {each} is there twice; remove one of them")
        seen.add(each)
    if len(names) > MOST_SHOTS:
        raise InputError(f"{where}: {len(names)} images; at most {MOST_SHOTS} are read: leave some out")
