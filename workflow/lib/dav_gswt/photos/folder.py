"""The photos/ folder: pictures, sparse model and ground.json, written as a whole or not at all."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.files import atomic_folder
from dav_gswt.geometry.scene_frame import SceneFrame, write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.lenses import Lens, write_lenses


def write_photo_folder(
    path: Path | str,
    model: ColmapModel,
    pictures: Iterable[tuple[str, Float[Array, "h w 3"]]],
    frame: SceneFrame,
    kinds: list[Lens] | None = None,
    covers: Mapping[str, Float32[Array, "h w"]] | None = None,
) -> None:
    """Write images/, sparse/, lenses.json and ground.json into the folder `path`, which is replaced.

    pictures: by file name. kinds: the lenses that they came through. covers: masks by the pictures' names, 0 where one
    does not count: they become the pictures' alpha, and go with them wherever they go.
    """
    covers = covers or {}
    with atomic_folder(path) as part:
        (part / "images").mkdir()
        for name, image in pictures:
            cover = covers.get(name)
            image_files.write_png(part / "images" / name, image if cover is None else np.dstack([image, cover]))
        (part / "sparse").mkdir()
        write_colmap_model(model, part / "sparse")
        if kinds:
            write_lenses(part, kinds)
        write_scene_frame(part / "ground.json", frame)
