"""Compose the Gaussians of a tile by its label map: each follows the label of the cell that holds its centre.

Patches are placed by whole cells of the coarsest level that is composed of them. Beyond that level the
cells of the composed tile are merged two by two (`merge_cells`). Cells do not cross its border, so
neighbours still match.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.field import SH0, GaussianField, concatenate_fields
from dav_gswt.lod.merge import merge_by_voxel
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import DISC_SIZES
from dav_gswt.tiles.layout import LABELS, Exemplar, source_cells

ABOVE = 0.5  # cells over the ground discs' mean height, from which a Gaussian is an occluder: rough ground is none


@dataclass(frozen=True)
class BinnedLevel:
    """A level's Gaussians by the exemplar's cells, row by row from the south-west: cell k holds start[k]:start[k+1]."""

    field: GaussianField
    exemplar: Exemplar
    cell: int  # finest cells along one cell of this level
    start: Int[Array, "k"]

    @property
    def cells(self) -> int:
        return self.exemplar.cells // self.cell

    @property
    def numbers(self) -> Int[Array, "n"]:
        """The cell of each Gaussian."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))


def bin_gaussians(field: GaussianField, exemplar: Exemplar, cell: int) -> BinnedLevel:
    """Sort a level's Gaussians by cell; those outside the exemplar are left out."""
    count = exemplar.cells // cell
    size = exemplar.spacing * cell
    column = np.floor((field.means[:, 0].astype(float) - exemplar.west) / size).astype(np.int64)
    row = np.floor((field.means[:, 1].astype(float) - exemplar.south) / size).astype(np.int64)
    inside = np.flatnonzero((column >= 0) & (row >= 0) & (column < count) & (row < count))
    key = row[inside] * count + column[inside]
    order = np.argsort(key, kind="stable")
    start = np.searchsorted(key[order], np.arange(count * count + 1))
    return BinnedLevel(field[inside[order]], exemplar, cell, start)


def compute_ground_maps(field: GaussianField, exemplar: Exemplar) -> tuple[Float[Array, "m m 3"], Float[Array, "m m"]]:
    """Mean colour and height of each finest cell's ground discs (all Gaussians', if none is ground); NaN for none."""
    level = bin_gaussians(field[field.ground] if field.ground.any() else field, exemplar, 1)
    count, values = np.diff(level.start), [*level.field.sh[:, 0].T * SH0 + 0.5, level.field.means[:, 2]]
    with np.errstate(invalid="ignore"):
        maps = [(np.bincount(level.numbers, v, len(count)) / count).reshape(level.cells, -1) for v in values]
    return np.stack(maps[:3], -1), maps[3]


def compute_cover(field: GaussianField, exemplar: Exemplar, height: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Share of each cell that is hidden, seen from above, by what stands over it, in [0, 1].

    It is the sum of opacity x 2 pi sigma_1 sigma_2 over the Gaussians whose centre lies ABOVE the cell, as
    a share of the cell, with sigma_1 and sigma_2 the two longer axes. Gaussians follow the cell of their
    centre, so a cut through a shrub leaves half a shrub: such a cut costs more
    (`energy.make_occluder_layer`).

    height: of the cells' ground; a cell where it is NaN has no occluder. A field without ground discs
    (an imported one) has none at all.
    """
    if not field.ground.any():
        return np.zeros(height.shape)
    level = bin_gaussians(field, exemplar, 1)
    up = level.field.means[:, 2] - height.ravel()[level.numbers] > ABOVE * exemplar.spacing
    cell, occluding = level.numbers[up], level.field[up]
    scales = np.sort(np.exp(occluding.log_scales.astype(float)), 1)
    opacity = 1 / (1 + np.exp(-occluding.opacity_logits.astype(float)))
    area = 2 * np.pi * opacity * scales[:, 1] * scales[:, 2] / exemplar.spacing**2
    return np.minimum(np.bincount(cell, area, height.size), 1.0).reshape(height.shape)


def coarsen_labels(labels: UInt8[Array, "n n"], factor: int) -> UInt8[Array, "k k"]:
    """Labels of cells `factor` times as wide: the majority inside, of equal ones the first in LABELS."""
    k = len(labels) // factor
    blocks = labels.reshape(k, factor, k, factor)
    counts = np.stack([(blocks == label).sum((1, 3)) for label in range(len(LABELS))])
    return counts.argmax(0).astype(np.uint8)


def gather_cells(
    level: BinnedLevel, rows: Int[Array, "h w"], columns: Int[Array, "h w"]
) -> tuple[Int[Array, "n"], Int[Array, "c"]]:
    """Indices of the Gaussians in cells, cell by cell, and how many each cell holds."""
    key = (rows * level.cells + columns).ravel()
    first, count = level.start[key], level.start[key + 1] - level.start[key]
    # the c-th Gaussian of a cell is the c-th after the first: positions within runs of varying length
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(first, count) + within, count


def compose_tile(
    level: BinnedLevel, labels: UInt8[Array, "n n"], shift: Int[Array, "9 2"], correction: Float[Array, "n n 4"]
) -> GaussianField:
    """A tile's Gaussians at one level, cell by cell from the south-west; x and y from its south-western corner.

    labels: of this level's cells (see `coarsen_labels`); shift in finest cells; correction: what each cell changes of
    colour (3) and height.
    """
    index, count = gather_cells(level, *source_cells(labels, shift, level.cell))
    tile = level.field[index]
    move = (shift[labels.ravel()] * level.exemplar.spacing).repeat(count, axis=0)
    means, change = tile.means.astype(float), correction.reshape(-1, 4).repeat(count, axis=0)
    means[:, :2] -= move + [level.exemplar.west, level.exemplar.south]
    side = len(labels) * level.cell * level.exemplar.spacing
    means[:, :2] = np.clip(means[:, :2], 0, side)  # rounding in float32 may pass the border by a hair
    means[:, 2] += change[:, 3]
    sh = tile.sh.copy()
    sh[:, 0] += (change[:, :3] / SH0).astype(np.float32)
    return replace(tile, means=means.astype(np.float32), sh=sh)


def bump(points: Float[Array, "n d"], side: float) -> Float[Array, "n"]:
    """sin^2(pi x / side) sin^2(pi y / side): 1 in a tile's middle, 0 on its border in value and slope."""
    s = np.sin(np.pi * points[:, :2].astype(float) / side) ** 2
    return s[:, 0] * s[:, 1]


def merge_cells(tile: GaussianField, cells: int, spacing: float) -> GaussianField:
    """The next level of a tile of `cells` x `cells` cells, an even number of at least 4, each `spacing` wide.

    The discs of four cells become one disc of their mean colour, height, opacity and uncertainty, twice
    as wide and tangent to the surface of these means. Other Gaussians are merged by moments in voxels of
    the new spacing. A tile that has an underlay gets a new one. A cell without any disc stays empty.
    """
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
    return concatenate_fields([parts[0], discs.make_underlay(grid, layer), parts[1]] if under.any() else parts)


def find_underlay(tile: GaussianField, spacing: float) -> Bool[Array, "n"]:
    """Which Gaussians of a tile are underlay, in any order: opaque as nothing else is that is so large."""
    large = tile.log_scales.max(1) > np.log(0.9 * discs.UNDERLAY_WIDTH * discs.STRIDE * spacing)
    return ~tile.ground & (tile.opacity_logits == discs.SOLID) & large


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
