"""The true materials and objects of synthetic ground, as a map from above."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int
from numpy import ndarray as Array
from scipy import ndimage

from dav_gswt.geometry.scene_frame import Extent, Square
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic.land import GroundLabels

CELLS = 600  # of the map along a side of the exemplar: 1 cm each
GAP = 3  # cells: gaps between twigs and leaves up to twice as wide belong to a footprint


@dataclass(frozen=True)
class LabelMap:
    """The labels of a rectangle of ground from above. Rows run from south to north, columns from west to east.

    material: numbers of `materials`, also below objects. object: a number from 1 for each; 0: none.
    """

    material: Int[Array, "rows columns"]
    object: Int[Array, "rows columns"]
    extent: Extent
    materials: dict[str, int]


def draw_scene_labels(scene: synthetic.Scene) -> LabelMap:
    """The map of a scene's exemplar. Raises: ValueError: its family has no labels."""
    labels = synthetic.FAMILIES[scene.family].make_land(scene.seed, synthetic.EXEMPLAR).labels
    if labels is None:
        raise ValueError(f"the ground of the family {scene.family} has no labels")
    return draw_label_map(labels, scene.frame.exemplar)


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
