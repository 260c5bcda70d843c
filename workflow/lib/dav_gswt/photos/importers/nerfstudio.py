"""Reader of transforms.json of nerfstudio and instant-ngp: OpenGL camera axes, intrinsics for all frames or for each.

Moves of the world (`applied_transform`, `applied_scale`) are not undone, as the ground frame does
not depend on them. Pixel centres are at half integers, as in COLMAP.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.photos.importers.checks import (
    ImportedImage,
    ImportedModel,
    check_distinct,
    check_entry,
    check_image_name,
    check_number,
    check_numbers,
    nearest_rotation,
)
from dav_gswt.photos.importers.lens_models import make_fisheye_camera, make_perspective_camera

PERSPECTIVE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV")
FISHEYE = "OPENCV_FISHEYE"
OPENGL = np.array([1.0, -1.0, -1.0])  # its camera looks along -z with y up
NUMBERS = (
    *(("w",), ("h",), ("fl_x", "camera_angle_x"), ("fl_y", "camera_angle_y"), ("cx",), ("cy",)),
    *((key,) for key in ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")),
)  # of a lens; of alternatives the first is used


def import_nerfstudio(
    path: Path, values: dict, photos: Path, size_of: Callable[[str], tuple[int, int] | None]
) -> ImportedModel:
    """The frames of the file. Points of `ply_file_path` are not read, as photos under known cameras
    give points.

    size_of: of a photo by its name, for files that give no size. Raises: InputError: with file, frame and key.
    """
    frames = check_entry(values, "frames", list, str(path))
    shots, lens_of = [], {}
    for i, frame in enumerate(frames):
        label = check_entry(frame, "file_path", str, f"{path}: frame {i}")
        name = check_image_name(label, photos, f"{path}: frame {i}")
        where = f"{path}: frame {name}"
        rotation, translation = _pose(frame, where)
        intrinsics = _intrinsics(values, frame, name, size_of, where)
        if intrinsics is not None and intrinsics not in lens_of:
            lens_of[intrinsics] = _lens(dict(intrinsics), where)
        shots.append(ImportedImage(name, lens_of.get(intrinsics), rotation, translation))
    check_distinct([s.name for s in shots], str(path))
    return ImportedModel(tuple(shots))


def _pose(frame: dict, where: str) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Rotation and translation into the camera, with x right and y down."""
    values, where = check_entry(frame, "transform_matrix", list, where), f"{where}: transform_matrix"
    rows = 4 if len(values) == 4 else 3
    matrix = np.eye(4)
    matrix[:rows] = check_numbers(values, (rows, 4), where)
    if np.abs(matrix[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise InputError(f"{where}: its last row is not 0 0 0 1; export the file again")
    turn = nearest_rotation(matrix[:3, :3], where) * OPENGL
    return turn.T, -turn.T @ matrix[:3, 3]


def _intrinsics(values: dict, frame: dict, name: str, size_of: Callable, where: str) -> tuple | None:
    """What the file says about a frame's lens, for the frame before for all; None where there is no size."""
    out = {}
    for keys in NUMBERS:
        said = [(key, source[key]) for source in (frame, values) for key in keys if source.get(key) is not None]
        for key, value in said[:1]:
            out[key] = check_number(value, f"{where}: {key}")
    if "w" not in out or "h" not in out:
        if (size := size_of(name)) is None:
            return None
        out |= {"w": float(size[0]), "h": float(size[1])}
    model = frame.get("camera_model") or values.get("camera_model")
    fisheye = frame.get("is_fisheye") is True or values.get("is_fisheye") is True
    return (("model", str(model or (FISHEYE if fisheye else "OPENCV"))), *sorted(out.items()))


def _lens(intrinsics: dict, where: str) -> pycolmap.Camera:
    """The lens that a frame's intrinsics describe."""
    for key in ("w", "h"):
        if intrinsics[key] != round(intrinsics[key]) or not 1 <= intrinsics[key] < 1e6:
            raise InputError(f"{where}: {key} is {intrinsics[key]:g}; it is a number of pixels")
    width, height, model = round(intrinsics["w"]), round(intrinsics["h"]), intrinsics["model"]
    for axis, side in (("x", width), ("y", height)):
        if (angle := intrinsics.get(f"camera_angle_{axis}")) is not None:
            if not 0 < angle < math.pi:
                raise InputError(f"{where}: camera_angle_{axis} is {angle:g}; a field of view lies between 0 and 3.14")
            intrinsics[f"fl_{axis}"] = 0.5 * side / math.tan(0.5 * angle)
    if "fl_x" not in intrinsics:
        raise InputError(f"{where}: neither fl_x nor camera_angle_x; add the focal length in pixels, for all or for it")
    pinhole = (
        intrinsics["fl_x"],
        intrinsics.get("fl_y", intrinsics["fl_x"]),
        intrinsics.get("cx", width / 2),
        intrinsics.get("cy", height / 2),
    )
    k = tuple(intrinsics.get(f"k{i}", 0.0) for i in range(1, 5))
    p = tuple(intrinsics.get(key, 0.0) for key in ("p1", "p2"))
    if model != FISHEYE and model not in PERSPECTIVE:
        known = ", ".join((*PERSPECTIVE, FISHEYE))
        raise InputError(f"{where}: camera_model {model[:40]} is not read, only {known}; undistort the pictures first")
    unused = ("k5", "k6", "p1", "p2") if model == FISHEYE else ("k4", "k5", "k6")  # programs differ in their meaning
    for key in unused:
        if intrinsics.get(key, 0.0) != 0:
            raise InputError(f"{where}: {key} is not read with camera_model {model}; calibrate without it")
    if model == FISHEYE:
        return make_fisheye_camera(width, height, pinhole, k, where)
    return make_perspective_camera(width, height, pinhole, k[:3], p, where)
