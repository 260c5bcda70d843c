"""Gaussians on disk, one file per column, so that other programs' files are made in parts with bounded memory."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, Float64
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.field import GaussianField
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.raster.interface import RIM
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area

COLUMNS = {"means": 3, "dc": 3, "opacity_logits": 1, "log_scales": 3, "quats": 4}  # float32 each
CHUNK = 262_144  # Gaussians that are read at once

Box = tuple[Float64[Array, "3"], Float64[Array, "3"]]  # the smallest and the largest of each coordinate


class Spool:
    """Gaussians whose colours do not depend on the view, in our axes.

    Use it as a context manager to append, then read its columns any number of times. Whoever made the folder
    removes it.
    """

    def __init__(self, folder: Path | str):
        self.folder, self.count = Path(folder), 0
        self.folder.mkdir(parents=True)
        self._open = ExitStack()
        self._files = {name: self._open.enter_context((self.folder / name).open("wb")) for name in COLUMNS}

    def __enter__(self) -> "Spool":
        return self

    def __exit__(self, *_) -> None:
        self._open.close()

    def __len__(self) -> int:
        return self.count

    def append(self, field: GaussianField) -> None:
        """Add Gaussians whose colours do not depend on the view."""
        for name, file in self._files.items():
            values = field.sh[:, 0] if name == "dc" else getattr(field, name)
            file.write(np.ascontiguousarray(values, "<f4").tobytes())
        self.count += len(field)

    def read(self, column: str) -> Iterator[Float32[Array, "n k"]]:
        """A column in parts, in the order of writing."""
        width = COLUMNS[column]
        with (self.folder / column).open("rb") as file:
            while len(values := np.fromfile(file, "<f4", CHUNK * width)):
                yield values.reshape(-1, width)

    def find_box(self) -> Box:
        """The box of the Gaussians as drawn: to RIM deviations.

        Raises: ValueError: there is no Gaussian.
        """
        boxes = []
        for means, scales, quats in zip(*map(self.read, ("means", "log_scales", "quats")), strict=True):
            points, axes = means.astype(float), Rotation.from_quat(quats, scalar_first=True).as_matrix()
            reach = RIM * np.sqrt(np.einsum("nij,nj->ni", axes**2, np.exp(2 * scales.astype(float))))
            boxes.append(((points - reach).min(0), (points + reach).max(0)))
        return unite_boxes(boxes)


@dataclass(frozen=True)
class ExportJob:
    """What a format's writer writes.

    Attributes:
        spool: the Gaussians of the area at the requested level.
        facts: about the files, for formats that keep such.
        place: puts cells on the surface at a level, on disk while its block runs.
        reference: place on earth, if it is known.
    """

    spool: Spool
    facts: Mapping[str, Any]
    terrain: EndlessTerrain
    area: Area
    place: Callable[[Area, int], AbstractContextManager[Spool]]
    reference: Georeference | None


def unite_boxes(boxes: list[Box]) -> Box:
    """The box about boxes. Raises: ValueError: there is none."""
    return np.min([low for low, _ in boxes], 0), np.max([high for _, high in boxes], 0)
