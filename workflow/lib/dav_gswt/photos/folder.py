"""The photos/ folder: pictures, sparse model and ground.json, there whole or not at all."""

from collections.abc import Iterable
from pathlib import Path

from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt import images
from dav_gswt.files import whole_folder, write_json
from dav_gswt.photos import model as models
from dav_gswt.photos.model import Model


def write(path: Path | str, model: Model, pictures: Iterable[tuple[str, Float[Array, "h w 3"]]], facts: dict) -> None:
    """Write images/, sparse/ and ground.json into the folder `path`, which is replaced. pictures: by file name."""
    with whole_folder(path) as part:
        (part / "images").mkdir()
        for name, image in pictures:
            images.write(part / "images" / name, image)
        (part / "sparse").mkdir()
        models.write(model, part / "sparse")
        write_json(part / "ground.json", facts)
