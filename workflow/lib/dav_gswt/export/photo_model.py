"""The photos of a round as a model that other programs train on: COLMAP's sparse/0.

The photos are those that the round's field was made of. The world frame and the unit are those of field.ply, and
cameras are pinholes, so a field trained elsewhere comes out where ours is. Photos that only test have a folder of
their own, `test`, of the same form: a program that is given the folder never sees them.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, require_file_name
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import TakenPhoto
from dav_gswt.photos.colmap_model import ColmapModel, colour_points, triangulate_model, write_colmap_model
from dav_gswt.photos.view_split import ViewSplit

TEST = "test"  # the folder of the photos that only test


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
    """Whether two cameras are equal: a device's photo may have the name of another photo of the model."""
    rows = [(*c.rotation.ravel(), *c.translation, c.fx, c.fy, c.cx, c.cy, c.width, c.height) for c in (one, other)]
    return np.allclose(*rows, atol=1e-6)


def _write_model(folder: Path, model: ColmapModel, photos: list[TakenPhoto]) -> None:
    """images/ and sparse/0 of one list of photos."""
    for part in ("images", "sparse/0"):
        (folder / part).mkdir(parents=True)
    for photo in photos:
        _copy_picture(photo, folder / "images")
    write_colmap_model(model, folder / "sparse/0")


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
