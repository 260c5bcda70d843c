"""Reader of transforms.json of nerfstudio and instant-ngp: OpenGL camera axes, intrinsics for all frames or for each.

Where a program moved the world (`applied_transform`, `applied_scale`), the move is undone: the world is that of the
model from which the file was made. Pixel centres are at half integers, as in COLMAP.
"""

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.photos.importers import lens_models
from dav_gswt.photos.importers.checks import (
    check_distinct,
    check_entry,
    check_image_name,
    check_number,
    check_numbers,
    nearest_rotation,
)
from dav_gswt.photos.importers.imported_model import ImportedImage, ImportedModel
from dav_gswt.photos.importers.lens_models import make_fisheye_camera, make_perspective_camera
from dav_gswt.photos.importers.point_ply import read_point_ply
from dav_gswt.photos.importers.points import measure_visible_share

_log = logging.getLogger(__name__)

PERSPECTIVE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV")
FISHEYE = "OPENCV_FISHEYE"
OPENGL = np.array([1.0, -1.0, -1.0])  # its camera looks along -z with y up


def import_nerfstudio(
    path: Path, values: dict, photos: Path, size_of: Callable[[str], tuple[int, int] | None]
) -> ImportedModel:
    """Shots, and the points of the file that `ply_file_path` names; nobody says which image sees them.

    size_of: of a photo by its name, for files that give no size. Raises: InputError: with file, frame and key.
    """
    frames = check_entry(values, "frames", list, str(path))
    world, scale = _read_world_transform(values, path)
    shots, lens_of = [], {}
    for i, frame in enumerate(frames):
        label = check_entry(frame, "file_path", str, f"{path}: frame {i}")
        name = check_image_name(label, photos, f"{path}: frame {i}")
        where = f"{path}: frame {name}"
        rotation, translation = _pose(frame, world, scale, where)
        intrinsics = _intrinsics(values, frame, name, size_of, where)
        if intrinsics is not None and intrinsics not in lens_of:
            lens_of[intrinsics] = _lens(dict(intrinsics), where)
        shots.append(ImportedImage(name, lens_of.get(intrinsics), rotation, translation))
    check_distinct([s.name for s in shots], str(path))
    points, colours = _points(path, values, shots, world, scale)
    return ImportedModel(tuple(shots), points, colours)


def _read_world_transform(values: dict, path: Path) -> tuple[Float[Array, "4 4"], float]:
    """What undoes the moves of the world: a rigid matrix after lengths are divided by a scale."""
    matrix, scale = np.eye(4), 1.0
    if values.get("applied_transform") is not None:
        where = f"{path}: applied_transform"
        matrix = _check_affine(values["applied_transform"], where)
        determinant = float(np.linalg.det(matrix[:3, :3]))
        if not determinant > 1e-18:
            raise InputError(f"{where} mirrors or flattens the world; export the file again")
        scale = determinant ** (1 / 3)
        matrix[:3, :3] = nearest_rotation(matrix[:3, :3] / scale, where)
        matrix[:3, 3] /= scale
    if values.get("applied_scale") is not None:
        factor = check_number(values["applied_scale"], f"{path}: applied_scale")
        if not factor > 1e-9:
            raise InputError(f"{path}: applied_scale is {factor:g}; it must be positive")
        scale *= factor
    back = np.eye(4)
    back[:3, :3], back[:3, 3] = matrix[:3, :3].T, -matrix[:3, :3].T @ matrix[:3, 3]
    return back, scale


def _check_affine(values, where: str) -> Float[Array, "4 4"]:
    """A matrix of three rows, or of four of which the last is 0 0 0 1."""
    rows = 4 if isinstance(values, list) and len(values) == 4 else 3
    matrix = np.eye(4)
    matrix[:rows] = check_numbers(values, (rows, 4), where)
    if np.abs(matrix[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise InputError(f"{where}: its last row is not 0 0 0 1; export the file again")
    return matrix


def _pose(frame: dict, world: Array, scale: float, where: str) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Rotation and translation into the camera, with x right and y down, from the undone world."""
    matrix = _check_affine(check_entry(frame, "transform_matrix", list, where), f"{where}: transform_matrix")
    turn = world[:3, :3] @ nearest_rotation(matrix[:3, :3], f"{where}: transform_matrix") * OPENGL
    return turn.T, -turn.T @ (world[:3, :3] @ matrix[:3, 3] / scale + world[:3, 3])


def _intrinsics(values: dict, frame: dict, name: str, size_of: Callable, where: str) -> tuple | None:
    """What the file says about a frame's lens, its own words before those for all; None where there is no size."""

    def read_value(*keys: str) -> dict:
        """The first of these keys that the frame, or else the file, has."""
        for source in (frame, values):
            for key in keys:
                if source.get(key) is not None:
                    return {key: check_number(source[key], f"{where}: {key}")}
        return {}

    out = {}
    for keys in (("w",), ("h",), ("fl_x", "camera_angle_x"), ("fl_y", "camera_angle_y"), ("cx",), ("cy",)):
        out |= read_value(*keys)
    for key in ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"):
        out |= read_value(key)
    if "w" not in out or "h" not in out:
        if (size := size_of(name)) is None:
            return None
        out |= {"w": float(size[0]), "h": float(size[1])}
    model = next((s["camera_model"] for s in (frame, values) if s.get("camera_model") is not None), None)
    if any(s.get("is_fisheye") is True for s in (frame, values)):
        model = model or FISHEYE
    return (("model", str(model or "OPENCV")), *sorted(out.items()))


def _lens(intrinsics: dict, where: str) -> pycolmap.Camera:
    """The lens that a frame's words describe."""
    width, height = (_check_pixels(intrinsics[key], f"{where}: {key}") for key in ("w", "h"))
    if "camera_angle_x" in intrinsics:
        intrinsics["fl_x"] = lens_models.angle_to_focal(intrinsics["camera_angle_x"], width, f"{where}: camera_angle_x")
    if "camera_angle_y" in intrinsics:
        intrinsics["fl_y"] = lens_models.angle_to_focal(
            intrinsics["camera_angle_y"], height, f"{where}: camera_angle_y"
        )
    if "fl_x" not in intrinsics:
        raise InputError(f"{where}: neither fl_x nor camera_angle_x; add the focal length in pixels, for all or for it")
    pinhole = (
        intrinsics["fl_x"],
        intrinsics.get("fl_y", intrinsics["fl_x"]),
        intrinsics.get("cx", width / 2),
        intrinsics.get("cy", height / 2),
    )
    k = [intrinsics.get(f"k{i}", 0.0) for i in range(1, 7)]
    p = [intrinsics.get(key, 0.0) for key in ("p1", "p2")]
    if intrinsics["model"] == FISHEYE:
        _check_unused(intrinsics, ("k5", "k6", "p1", "p2"), where)
        return make_fisheye_camera(width, height, pinhole, tuple(k[:4]), where)
    if intrinsics["model"] in PERSPECTIVE:
        _check_unused(intrinsics, ("k4", "k5", "k6"), where)  # programs differ about what they mean
        return make_perspective_camera(width, height, pinhole, tuple(k[:3]), tuple(p), where)
    known = ", ".join((*PERSPECTIVE, FISHEYE))
    raise InputError(
        f"{where}: camera_model {intrinsics['model'][:40]} is not read, only {known}; undistort the pictures first"
    )


def _check_pixels(value: float, where: str) -> int:
    if value != round(value) or not 1 <= value < 1e6:
        raise InputError(f"{where} is {value:g}; it is a number of pixels")
    return round(value)


def _check_unused(intrinsics: dict, keys: tuple[str, ...], where: str) -> None:
    for key in keys:
        if intrinsics.get(key, 0.0) != 0:
            raise InputError(
                f"{where}: {key} is not read with camera_model {intrinsics['model']}; calibrate without it"
            )


def _points(path: Path, values: dict, shots: list[ImportedImage], world: Array, scale: float) -> tuple[Array, Array]:
    """Points in the undone world. Programs disagree whether the file's points were moved with the cameras.

    So they are taken as the photos see more of them.
    """
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    if values.get("ply_file_path") is None:
        return none
    where = f"{path}: ply_file_path"
    label = check_entry(values, "ply_file_path", str, str(path))
    file = path.parent / check_image_name(label, path.parent, where)
    if not file.is_file():
        _log.warning("%s: there is no file %s; points come from the photos alone", where, file)
        return none
    if not file.resolve().is_relative_to(path.parent.resolve()):
        raise InputError(f"{where}: {label[:80]!r} leads out of {path.parent}; put the file beside transforms.json")
    points, colours = read_point_ply(file)
    undone = points / scale @ world[:3, :3].T + world[:3, 3]
    return (points if measure_visible_share(points, shots) > measure_visible_share(undone, shots) else undone), colours
