"""Masks that people draw over the exemplar from above: which ground is which material, and what is not shown."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import image_files

EXCLUDE = "exclude"  # name of the mask of ground that is shown nowhere
NO_CLASS = -1  # of cells that are of no material
HALF = 0.5  # brightness from which a pixel counts
ASPECT = 0.01  # a mask that is less square is not of the exemplar


@dataclass(frozen=True)
class GroundMasks:
    """Masks over the cells of an exemplar, row 0 in the south.

    materials: by name; where two overlap, the first counts. Without any, materials are found by their looks.
    excluded: ground that is shown nowhere.
    """

    materials: Mapping[str, Bool[Array, "m m"]]
    excluded: Bool[Array, "m m"]

    def label(self) -> tuple[Int[Array, "m m"], list[str]]:
        """Number of each cell's material, by descending share, or NO_CLASS; and the materials' names."""
        labels = np.full(self.excluded.shape, NO_CLASS)
        names = list(self.materials)
        for number in reversed(range(len(names))):
            labels[self.materials[names[number]]] = number
        labels[self.excluded] = NO_CLASS
        counts = [int((labels == number).sum()) for number in range(len(names))]
        order = sorted((k for k in range(len(names)) if counts[k]), key=lambda k: -counts[k])
        place = np.full(len(names) + 1, NO_CLASS)  # the last is of cells without one
        place[order] = np.arange(len(order))
        return place[labels], [names[k] for k in order]


def read_masks(files: Mapping[str, Path | str], cells: int) -> GroundMasks:
    """Read masks, drawn over `ground.png`: north up, white where the ground is what the name says.

    They may have any number of pixels, as long as they are square.
    Raises: InputError: not readable, not square, or white nowhere; all masks together leave nothing.
    """
    masks = {name: read_mask(path, cells) for name, path in files.items()}
    excluded = masks.pop(EXCLUDE, np.zeros((cells, cells), bool))
    if (excluded if not masks else ~np.any(list(masks.values()), axis=0) | excluded).all():
        raise InputError(f"{', '.join(str(path) for path in files.values())}: these masks leave no ground to tile")
    return GroundMasks(masks, excluded)


def read_mask(path: Path | str, cells: int) -> Bool[Array, "m m"]:
    """One mask at the resolution of the exemplar. Raises: InputError: see `read_masks`."""
    bright = image_files.read_photo(path).mean(-1)
    height, width = bright.shape
    if abs(width / height - 1) > ASPECT:
        raise InputError(
            f"{path}: is {width} x {height} pixels; a mask of materials is square, drawn over materials/ground.png"
        )
    at = (np.arange(cells) + 0.5) / cells
    mask = bright[np.ix_((at * height).astype(int), (at * width).astype(int))][::-1] >= HALF
    if not mask.any():
        raise InputError(f"{path}: is white nowhere; paint what it names white and the rest black")
    return mask
