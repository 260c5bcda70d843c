"""The true materials and objects of synthetic ground, and their map from above, which evaluations read.

The map is truth/ground_labels.exr, with the channels material and object; its header says what their numbers mean. The
product does not read it.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Int
from numpy import ndarray as Array
from scipy import ndimage

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.geometry.scene_frame import Extent, Square
from dav_gswt.images import image_files

MAP = "ground_labels.exr"
CELLS = 600  # of the map along a side of the exemplar: 1 cm each
GAP = 3  # cells: gaps between twigs and leaves up to twice as wide belong to a footprint


@dataclass(frozen=True)
class GroundLabels:
    """What a piece of land consists of.

    materials: numbers by name, from 1. material: the number at every place, over a square that repeats after `period`
    metres (as in `noise`). objects: of each single thing, shrub or boulder, the vertices of its mesh above the ground.
    """

    materials: dict[str, int]
    material: Int[Array, "n n"]
    period: float
    objects: tuple[Float32[Array, "_ 3"], ...]


@dataclass(frozen=True)
class LabelMap:
    """The labels of a rectangle of ground from above. Rows run from south to north, columns from west to east.

    material: numbers of `materials`, also below objects. object: a number from 1 for each; 0: none.
    """

    material: Int[Array, "rows columns"]
    object: Int[Array, "rows columns"]
    extent: Extent
    materials: dict[str, int]


def draw_label_map(labels: GroundLabels, square: Square, cells: int = CELLS) -> LabelMap:
    """The map of a square, of cells x cells, each labelled by its centre. Objects that do not reach it are left out."""
    at, n = (np.arange(cells) + 0.5) * square.side / cells, len(labels.material)
    column, row = (np.floor((low + at) * n / labels.period).astype(int) % n for low in (square.west, square.south))
    objects = np.zeros((cells, cells), int)
    for i, vertices in enumerate(labels.objects, start=1):
        objects[rasterize_footprint(vertices, square, cells) & (objects == 0)] = i
    extent = Extent(square.west, square.south, square.east, square.north)
    return LabelMap(labels.material[np.ix_(row, column)], objects, extent, labels.materials)


def rasterize_footprint(vertices: Float32[Array, "v 3"], square: Square, cells: int) -> Bool[Array, "cells cells"]:
    """The cells that an object covers from above: the cells of its vertices, and gaps between them; one piece."""
    edge = GAP + 1  # so that closing does not end at the border
    column, row = (
        np.floor((vertices[:, k] - low) * cells / square.side).astype(int) + edge
        for k, low in enumerate((square.west, square.south))
    )
    size = cells + 2 * edge
    inside = (np.minimum(column, row) >= 0) & (np.maximum(column, row) < size)
    hit = np.zeros((size, size), bool)
    hit[row[inside], column[inside]] = True
    whole = ndimage.binary_fill_holes(ndimage.binary_closing(hit, np.ones((3, 3), int), iterations=GAP))
    pieces, count = ndimage.label(whole)
    if count > 1:
        whole = pieces == 1 + np.argmax(np.bincount(pieces.ravel())[1:])
    return whole[edge:-edge, edge:-edge]


def write_label_map(folder: Path | str, labels: LabelMap) -> None:
    """Write a map. On disk the first row is the northern one, as in any image of a map."""
    channels = {"material": labels.material[::-1], "object": labels.object[::-1]}
    names = {key: json.dumps(asdict(labels)[key]) for key in ("extent", "materials")}
    image_files.write_exr(Path(folder) / MAP, {k: v.astype(np.float32) for k, v in channels.items()}, names)


def read_label_map(folder: Path | str) -> LabelMap:
    """Read the map of a photo set from its truth/ folder.

    Raises: InputError: there is none, as for families without labels, or the file is of another kind.
    """
    path = Path(folder) / MAP
    channels, header = image_files.read_exr(path)
    try:
        material, objects = (np.rint(channels[name][::-1]).astype(int) for name in ("material", "object"))
        extent, materials = (json.loads(header[key]) for key in ("extent", "materials"))
        return LabelMap(material, objects, Extent(**extent), materials)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not a map of labels ({summarize_error(error)}); make the photos again") from error
