"""The photos of a round as a model that other programs train on: COLMAP's sparse/0, nerfstudio's transforms.json.

The photos are those that the round's field was made of. The world frame and the unit are those of field.ply, and
cameras are pinholes, so a field trained elsewhere comes out where ours is. Photos that only test have a folder of
their own, `test`, of the same form: a program that is given the folder never sees them.
"""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, require_file_name
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import TakenPhoto
from dav_gswt.photos.colmap_model import ColmapModel, colour_points, triangulate_model, write_colmap_model
from dav_gswt.photos.view_split import ViewSplit

OPENGL = np.array([1.0, -1.0, -1.0])  # nerfstudio's camera looks along -z with y up
TEST = "test"  # the folder of the photos that only test
POINTS = "sparse_pc.ply"  # as nerfstudio calls it


def write_photo_models(out: Path | str, images: Path | str, known: ColmapModel, split: ViewSplit, taken: list) -> None:
    """Write the photos `taken` and their model into the folder `out`, and the test photos into `out`/test.

    Points are those that the taken photos see, found from these alone: nothing of the pool or of the test photos is in
    them. Raises: InputError: a picture that is missing or not of its camera's size, or a name that leads elsewhere.
    """
    model = _model_of(taken, known)
    tests = [TakenPhoto(name, Path(images) / name, known.camera(name), 0) for name in split.test]
    blind = replace(model, point_of=model.point_of[:0], image_of=model.image_of[:0], pixels=model.pixels[:0])
    with atomic_folder(out) as folder:
        _write_model(folder, model, taken)
        if tests:
            names, cameras = tuple(p.name for p in tests), tuple(p.camera for p in tests)
            _write_model(folder / TEST, replace(blind, names=names, cameras=cameras), tests)


def _model_of(taken: list[TakenPhoto], known: ColmapModel) -> ColmapModel:
    """Cameras of all photos taken, and points of those that the known model has."""
    seen = {p.name: i for i, p in enumerate(taken) if p.name in known.names and _same(p.camera, known.camera(p.name))}
    sources = {photo.name: photo.source for photo in taken}
    part = triangulate_model(known, list(seen))
    colours = colour_points(part, [sources[name] for name in part.names])
    image_of = np.array([seen[name] for name in part.names], int)[part.image_of]
    order = np.lexsort((image_of, part.point_of))
    return ColmapModel(
        tuple(photo.name for photo in taken),
        tuple(photo.camera for photo in taken),
        part.points,
        colours,
        part.point_of[order],
        image_of[order],
        part.pixels[order],
    )


def _same(one: Camera, other: Camera) -> bool:
    """Whether two cameras are one: a device's photo may have the name of another one of the model."""
    poses = (one.rotation, other.rotation), (one.translation, other.translation)
    lenses = [(c.fx, c.fy, c.cx, c.cy, c.width, c.height) for c in (one, other)]
    return all(np.allclose(a, b, atol=1e-6) for a, b in (*poses, lenses))


def _write_model(folder: Path, model: ColmapModel, photos: list[TakenPhoto]) -> None:
    """images/, sparse/0, transforms.json and its points of one list of photos."""
    for part in ("images", "sparse/0"):
        (folder / part).mkdir(parents=True)
    for photo in photos:
        _copy_picture(photo, folder / "images")
    write_colmap_model(model, folder / "sparse/0")
    _write_points(model, folder / POINTS)
    text = json.dumps(describe_transforms(model), indent=1, allow_nan=False) + "\n"
    (folder / "transforms.json").write_text(text, encoding="utf-8")


def _copy_picture(photo: TakenPhoto, folder: Path) -> None:
    """A copy, no link: programs that shrink pictures in place must not reach the results."""
    try:
        name = require_file_name(photo.name)
    except ValueError as error:
        raise InputError(f"{photo.source}: {error}; make the photos again") from error
    size = image_files.read_size(photo.source)
    if size != (photo.camera.width, photo.camera.height):
        raise InputError(
            f"{photo.source}: {size[0]} x {size[1]} pixels, its camera takes {photo.camera.width} x "
            f"{photo.camera.height}; make the photos again"
        )
    shutil.copyfile(photo.source, folder / name)


def describe_transforms(model: ColmapModel) -> dict:
    """transforms.json of a model: camera to world in OpenGL's axes, a lens for each frame.

    The world is not moved: `applied_transform` is the identity. Source: nerfstudio's data conventions.
    """
    frames = []
    for i, (name, camera) in enumerate(zip(model.names, model.cameras, strict=True)):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = camera.rotation.T * OPENGL, camera.centre
        lens = {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy}
        lens |= {"w": camera.width, "h": camera.height}
        where = {"file_path": f"images/{name}", "transform_matrix": pose.tolist(), "colmap_im_id": i + 1}
        frames.append(where | lens)
    whole = {"camera_model": "PINHOLE", "applied_transform": np.eye(4)[:3].tolist(), "ply_file_path": POINTS}
    return whole | {"frames": frames}


def _write_points(model: ColmapModel, path: Path) -> None:
    rows = np.empty(
        len(model.points), [(axis, "<f4") for axis in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")]
    )
    for j, axis in enumerate("xyz"):
        rows[axis] = model.points[:, j]
    for j, channel in enumerate(("red", "green", "blue")):
        rows[channel] = np.rint(model.colours[:, j] * 255)
    PlyData([PlyElement.describe(rows, "vertex")], byte_order="<").write(str(path))
