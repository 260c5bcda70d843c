"""Reader of transforms.json of nerfstudio and instant-ngp: OpenGL camera axes, intrinsics for all frames or for each.

Moves of the world (`applied_transform`, `applied_scale`) are not undone, as the ground frame does
not depend on them. Pixel centres are at half integers, as in COLMAP.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pycolmap
from pydantic import Field

from dav_gswt.errors import InputError
from dav_gswt.photos.importers.checks import ImportedImage, ImportedModel, check_image_name, check_pose, parse_part
from dav_gswt.photos.importers.lens_models import make_lens

PERSPECTIVE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV")
FISHEYE = "OPENCV_FISHEYE"
OPENGL = np.array([1.0, -1.0, -1.0])  # its camera looks along -z with y up
Angle = Annotated[float, Field(gt=0, lt=math.pi)]  # a field of view


@dataclass(frozen=True)
class Frame:
    """A frame of the file. transform_matrix: its first three or all four rows; takes the camera to the world."""

    file_path: str
    transform_matrix: Annotated[list[tuple[float, float, float, float]], Field(min_length=3, max_length=4)]


@dataclass(frozen=True)
class Intrinsics:
    """What the file says of a lens. camera_angle_x, camera_angle_y: fields of view, used where fl_x or fl_y is not
    given."""

    w: float | None = None
    h: float | None = None
    fl_x: float | None = None
    fl_y: float | None = None
    camera_angle_x: Angle | None = None
    camera_angle_y: Angle | None = None
    cx: float | None = None
    cy: float | None = None
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    camera_model: str | None = None
    is_fisheye: bool = False


def import_nerfstudio(path: Path, values: dict, size_of: Callable[[str], tuple[int, int] | None]) -> ImportedModel:
    """The frames of the file. Points of `ply_file_path` are not read, as photos under known cameras
    give points.

    size_of: of a photo by its name, for files that give no size. Raises: InputError: with file, frame and key.
    """
    images, lens_of = [], {}
    for i, part in enumerate(values["frames"]):
        frame = parse_part(part, Frame, f"{path}: frame {i}")
        name = check_image_name(frame.file_path, f"{path}: frame {i}")
        where = f"{path}: frame {name}"
        if frame.transform_matrix[3:] not in ([], [(0, 0, 0, 1)]):
            raise InputError(f"{where}: transform_matrix: its last row is not 0 0 0 1; export the file again")
        turn, centre = check_pose(np.array(frame.transform_matrix[:3]), f"{where}: transform_matrix")
        turn = turn * OPENGL
        said = _read_intrinsics(values, part, where)
        if said.w is None or said.h is None:
            if not (size := size_of(name)):
                continue  # there is no such photo
            said = replace(said, w=float(size[0]), h=float(size[1]))
        if said not in lens_of:
            lens_of[said] = _make_lens(said, where)
        images.append(ImportedImage(name, lens_of[said], turn.T, -turn.T @ centre))
    return ImportedModel(tuple(images))


def _read_intrinsics(values: dict, frame: dict, where: str) -> Intrinsics:
    """What the file says about a frame's lens, for the frame before for all."""
    keys = [field.name for field in fields(Intrinsics)]
    own, shared = ({key: part[key] for key in keys if part.get(key) is not None} for part in (frame, values))
    for axis in "xy":
        if f"camera_angle_{axis}" in own:
            shared.pop(f"fl_{axis}", None)
    return parse_part(shared | own, Intrinsics, where)


def _make_lens(said: Intrinsics, where: str) -> pycolmap.Camera:
    """The lens that a frame's intrinsics describe."""
    assert said.w is not None and said.h is not None
    width, height = round(said.w), round(said.h)
    fx = said.fl_x or (0.5 * width / math.tan(0.5 * said.camera_angle_x) if said.camera_angle_x else None)
    fy = said.fl_y or (0.5 * height / math.tan(0.5 * said.camera_angle_y) if said.camera_angle_y else fx)
    if fx is None or fy is None:
        raise InputError(f"{where}: neither fl_x nor camera_angle_x; add the focal length in pixels, for all or for it")
    cx, cy = width / 2 if said.cx is None else said.cx, height / 2 if said.cy is None else said.cy
    model = said.camera_model or (FISHEYE if said.is_fisheye else "OPENCV")
    if model != FISHEYE and model not in PERSPECTIVE:
        known = ", ".join((*PERSPECTIVE, FISHEYE))
        raise InputError(f"{where}: camera_model {model[:40]} is not read, only {known}; undistort the pictures first")
    unused = ("k5", "k6", "p1", "p2") if model == FISHEYE else ("k4", "k5", "k6")  # programs differ in their meaning
    for key in unused:
        if getattr(said, key) != 0:
            raise InputError(f"{where}: {key} is not read with camera_model {model}; calibrate without it")
    k, p = (said.k1, said.k2, said.k3, said.k4), (said.p1, said.p2)
    return make_lens((width, height), (fx, fy, cx, cy), k, p, model == FISHEYE, where)
