"""Coarser levels of a tile, merged from its own cells, two by two.

Patches are placed by whole cells of the coarsest level that is composed of them. Beyond that level the composed tile,
with its cuts and corrections, is merged: cells do not cross its border, so neighbours still match.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.lod.merge import merge_by_voxel
from dav_gswt.reconstruction import discs, underlay
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import DISC_SIZES


def merge_cells(tile: GaussianField, cells: int, spacing: float) -> GaussianField:
    """The next level of a tile of `cells` x `cells` cells, an even number, each `spacing` wide.

    The discs of four cells become one with their mean colour, height, opacity and uncertainty, twice as wide and
    tangent to the surface of these means. Other Gaussians are merged by moments in voxels of the new spacing; a tile
    that has an underlay gets a new one. A cell over which there was no disc has none.

    Raises: ValueError: an odd number of cells, or too few for a slope.
    """
    if cells % 2 or cells < 4:
        raise ValueError(f"{cells} cells do not make a coarser level: an even number is needed, at least 4")
    under = find_underlay(tile, spacing)
    known, (*colour, height, uncertainty, logit, size) = _average_discs(tile[tile.ground], cells // 2, 2 * spacing)
    grid = Ground(0.0, 0.0, 2 * spacing, 0, 0, cells // 2, height, known)
    layer = discs.make_ground_discs(grid, np.stack(colour, -1).reshape(-1, 3))
    scales = layer.log_scales.copy()
    scales[:, :2] = (size + np.log(2)).reshape(-1, 1).clip(*np.log(np.multiply(DISC_SIZES, grid.spacing)))
    layer = replace(
        layer,
        log_scales=scales,
        opacity_logits=logit.ravel().astype(np.float32),
        uncertainty=uncertainty.ravel().astype(np.float32),
    )
    parts = [layer[known.ravel()], merge_by_voxel(tile[~tile.ground & ~under], 2 * spacing)]
    return concatenate_fields([parts[0], underlay.make_underlay(grid, layer), parts[1]] if under.any() else parts)


def find_underlay(tile: GaussianField, spacing: float) -> Bool[Array, "n"]:
    """Which Gaussians of a tile are underlay, in any order: opaque as nothing else is that is so large."""
    large = tile.log_scales.max(1) > np.log(0.9 * underlay.WIDTH * underlay.STRIDE * spacing)
    return ~tile.ground & (tile.opacity_logits == underlay.SOLID) & large


def _average_discs(
    layer: GaussianField, cells: int, spacing: float
) -> tuple[Bool[Array, "k k"], list[Float[Array, "k k"]]]:
    """Which cells hold discs, and the means of these: red, green, blue, height, uncertainty, opacity's logit, logarithm
    of the width; the nearest cell's where there are none."""
    column, row = (np.clip((layer.means[:, i] / spacing).astype(int), 0, cells - 1) for i in (0, 1))
    key = row * cells + column
    count = np.bincount(key, minlength=cells**2)
    known = (count > 0).reshape(cells, cells)
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    sizes = layer.log_scales[:, :2].mean(1)
    values = [*layer.base_colours.T, layer.means[:, 2], layer.uncertainty, layer.opacity_logits, sizes]
    means = [np.bincount(key, v.astype(float), cells**2) / np.maximum(count, 1) for v in values]
    return known, [m.reshape(cells, cells)[tuple(nearest)] for m in means]
