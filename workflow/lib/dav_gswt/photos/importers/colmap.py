"""Reader of COLMAP's sparse models, binary or text: cameras, images and points.

pycolmap is not used to read them, because it trusts the counts in a file: a damaged one may end the process.
Formats: colmap.github.io/format.html. Rigs and frames are skipped: they repeat what images say.
"""

import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pycolmap
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.photos.importers import checks
from dav_gswt.photos.importers.checks import check_distinct, check_finite, check_image_name, check_size
from dav_gswt.photos.importers.imported_model import ImportedImage, ImportedModel
from dav_gswt.photos.importers.lens_models import make_camera

_PLACES = ("", "sparse", "sparse/0", "0")  # where a model lies below the folder that is given
_MODELS = {int(number): name for name, number in pycolmap.CameraModelId.__members__.items() if name != "INVALID"}
_COUNTS = {n: len(pycolmap.Camera.create_from_model_name(1, n, 1.0, 1, 1).params) for n in _MODELS.values()}
_NO_POINT = -1
MOST_NUMBER = 2**53  # of points: below, numbers are exact in tables of floats


def find_colmap_folder(folder: Path) -> Path | None:
    """The folder at or below this one that holds a model, if any."""
    places = [folder / place for place in _PLACES]
    return next((p for p in places if any(_has_both(p, kind) for kind in ("bin", "txt"))), None)


def import_colmap(folder: Path, photos: Path) -> ImportedModel:
    """Read a model. Raises: InputError: damaged, or what it says cannot be."""
    kind = "bin" if _has_both(folder, "bin") else "txt"
    cameras = _cameras(folder / f"cameras.{kind}", {"bin": _binary_cameras, "txt": _text_cameras}[kind])
    shots, seen = _images(
        folder / f"images.{kind}", {"bin": _binary_images, "txt": _text_images}[kind], cameras, photos
    )
    path = folder / f"points3D.{kind}"
    if not path.is_file():
        return ImportedModel(shots)
    rows = {"bin": _binary_points, "txt": _text_points}[kind](path)
    ids, order = np.unique(rows[:, 0], return_index=True)
    if len(ids) < len(rows):
        raise InputError(f"{path}: a point is there twice; export the model again")
    points, colours = check_finite(rows[order, 1:4], str(path)), (rows[order, 4:7] / 255).astype(np.float32)
    owners = np.repeat(np.arange(len(shots)), [len(s) for s in seen])
    flat = np.concatenate(seen) if seen else np.zeros((0, 3))
    references = flat[:, 2]
    place = np.searchsorted(ids, references)
    known = place < len(ids)
    known[known] = ids[place[known]] == references[known]
    if not known.all():
        k = int(np.flatnonzero(~known)[0])
        raise InputError(
            f"{path}: has no point {references[k]:.0f}, which {shots[owners[k]].name} sees; export the model again"
        )
    return ImportedModel(shots, points, colours, place, owners, flat[:, :2])


def _has_both(folder: Path, kind: str) -> bool:
    return all((folder / f"{part}.{kind}").is_file() for part in ("cameras", "images"))


def _cameras(path: Path, rows: Callable) -> dict[int, pycolmap.Camera]:
    cameras = {}
    for number, model, width, height, params in rows(path):
        where = f"{path}: camera {number}"
        if number in cameras:
            raise InputError(f"{where} is there twice; export the model again")
        cameras[number] = make_camera(model, width, height, params, where)
    return cameras


def _images(path: Path, rows: Callable, cameras: dict, photos: Path) -> tuple[tuple[ImportedImage, ...], list[Array]]:
    """Shots, and of each what it sees: column, row and point."""
    shots, seen = [], []
    for pose, camera, label, points in rows(path):
        name = check_image_name(label, photos, str(path))
        where = f"{path}: image {name}"
        if camera not in cameras:
            raise InputError(f"{where}: there is no camera {camera}; export the model again")
        rotation = _rotation(check_finite(np.array(pose), where)[:4], where)
        shots.append(ImportedImage(name, cameras[camera], rotation, np.array(pose[4:])))
        seen.append(check_finite(points[points[:, 2] != _NO_POINT], where))
    check_distinct([s.name for s in shots], str(path))
    return tuple(shots), seen


def _rotation(quaternion: Array, where: str) -> Array:
    """The rotation of w, x, y, z. Raises: InputError: its length is not 1."""
    with np.errstate(over="ignore"):
        length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) <= checks.ORTHONORMAL:
        raise InputError(f"{where}: its quaternion has length {length:g}, not 1; export the model again")
    w, x, y, z = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class _Bytes:
    """A binary file that is read from its start to its end; a count is checked against the bytes that are left."""

    def __init__(self, path: Path):
        check_size(path, checks.LARGEST)
        self.path, self.data, self.at = path, path.read_bytes(), 0

    def take(self, form: str) -> tuple:
        size = struct.calcsize("<" + form)
        self.check_room(size)
        self.at += size
        return struct.unpack_from("<" + form, self.data, self.at - size)

    def count(self, each: int) -> int:
        """A number of records of at least `each` bytes."""
        (n,) = self.take("Q")
        self.check_room(n * each)
        return n

    def check_room(self, size: int) -> None:
        if size > len(self.data) - self.at:
            raise InputError(f"{self.path}: cut short or damaged at byte {self.at}; copy or export it again")

    def text(self) -> str:
        end = self.data.find(b"\0", self.at, self.at + checks.LONGEST_NAME)
        if end < 0:
            raise InputError(f"{self.path}: a name without end at byte {self.at}; copy or export it again")
        raw, self.at = self.data[self.at : end], end + 1
        return raw.decode("utf-8", errors="replace")

    def check_end(self) -> None:
        if self.at != len(self.data):
            raise InputError(f"{self.path}: {len(self.data) - self.at} bytes too long; copy or export it again")


def _binary_cameras(path: Path) -> Iterator[tuple]:
    file = _Bytes(path)
    for _ in range(file.count(24)):
        number, model, width, height = file.take("IiQQ")
        if model not in _MODELS:
            raise InputError(f"{path}: camera {number}: there is no camera model {model}; export the model again")
        yield number, _MODELS[model], width, height, file.take("d" * _COUNTS[_MODELS[model]])
    file.check_end()


def _binary_images(path: Path) -> Iterator[tuple]:
    file = _Bytes(path)
    for _ in range(file.count(73)):
        _, *pose, camera = file.take("I7dI")
        name = file.text()
        n = file.count(24)
        rows = np.frombuffer(file.data, [("xy", "<f8", 2), ("point", "<i8")], n, file.at)
        file.at += 24 * n
        yield pose, camera, name, np.c_[rows["xy"], rows["point"]]
    file.check_end()


def _binary_points(path: Path) -> Array:
    """Rows of number, x, y, z, red, green, blue."""
    file = _Bytes(path)
    rows = np.empty((_check_point_count(file.count(51), path), 7))
    for row in rows:
        *row[:], _, track = file.take("Q3d3BdQ")
        if not row[0] < MOST_NUMBER:
            raise InputError(f"{path}: a point of number {row[0]:.0f}; copy or export the model again")
        file.check_room(8 * track)
        file.at += 8 * track
    file.check_end()
    return rows


def _lines(path: Path) -> Iterator[str]:
    """The lines of a text file without its comments; empty lines stay."""
    check_size(path, checks.LARGEST)
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if not line.startswith("#"):
                yield line.strip()


def _text_cameras(path: Path) -> Iterator[tuple]:
    for line in filter(None, _lines(path)):
        try:
            number, model, width, height, *params = line.split()
            values = int(number), model, int(width), int(height), tuple(map(float, params))
        except ValueError:
            raise _unreadable_line(path, line, "CAMERA_ID MODEL WIDTH HEIGHT PARAMS") from None
        yield values


def _text_images(path: Path) -> Iterator[tuple]:
    lines = _lines(path)
    for line in lines:
        if not line:
            continue
        try:
            _, *pose, camera, name = line.split(None, 9)
            values = [float(v) for v in pose], int(camera), name
            seen = np.array(next(lines, "").split(), float).reshape(-1, 3)
            if len(values[0]) != 7:
                raise ValueError
        except ValueError:
            raise _unreadable_line(
                path, line, "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and X Y POINT3D_ID"
            ) from None
        yield *values, seen


def _text_points(path: Path) -> Array:
    """Rows of number, x, y, z, red, green, blue."""
    rows = []
    for line in filter(None, _lines(path)):
        try:
            rows.append(tuple(map(float, line.split(None, 7)[:7])))
            if len(rows[-1]) != 7 or not 0 <= rows[-1][0] < MOST_NUMBER or not all(0 <= c <= 255 for c in rows[-1][4:]):
                raise ValueError
        except ValueError:
            raise _unreadable_line(path, line, "POINT3D_ID X Y Z R G B") from None
    return np.array(rows, float).reshape(_check_point_count(len(rows), path), 7)


def _check_point_count(points: int, path: Path) -> int:
    if points > checks.MOST_POINTS:
        raise InputError(f"{path}: {points} points; at most {checks.MOST_POINTS} are read: export a sparse model")
    return points


def _unreadable_line(path: Path, line: str, expected: str) -> InputError:
    return InputError(f"{path}: {line[:60]!r} does not read as {expected}; export the model as text again")
