"""Compose the Gaussians of a tile by its label map: each follows the label of the cell that holds its centre."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.tiles.layout import LABELS, Exemplar, source_cells


@dataclass(frozen=True)
class BinnedLevel:
    """A level's Gaussians sorted by the exemplar's cells (row-major from the south-west): cell k holds
    start[k]:start[k+1].
    """

    field: GaussianField
    exemplar: Exemplar
    cell: int  # finest cells along one cell of this level
    start: Int[Array, "k"]

    @property
    def cells(self) -> int:
        return self.exemplar.cells // self.cell


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


def count_discs(level: BinnedLevel) -> Int[Array, "m m"]:
    """How many ground discs each cell holds."""
    total = np.concatenate([[0], np.cumsum(level.field.ground)])
    return np.diff(total[level.start]).reshape(level.cells, level.cells)


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


def compose_tile(level: BinnedLevel, labels: UInt8[Array, "n n"], shift: Int[Array, "9 2"]) -> GaussianField:
    """A tile's Gaussians at one level, cell by cell from the south-west; x and y from its south-western corner, z kept.

    labels: of this level's cells (see `coarsen_labels`); shift in finest cells.
    """
    index, count = gather_cells(level, *source_cells(labels, shift, level.cell))
    tile = level.field[index]
    move = (shift[labels.ravel()] * level.exemplar.spacing).repeat(count, axis=0)
    means = tile.means.astype(float)
    means[:, :2] -= move + [level.exemplar.west, level.exemplar.south]
    side = len(labels) * level.cell * level.exemplar.spacing
    means[:, :2] = np.clip(means[:, :2], 0, side)  # rounding in float32 may pass the border by a hair
    return replace(tile, means=means.astype(np.float32))


def bump(points: Float[Array, "n d"], side: float) -> Float[Array, "n"]:
    """sin^2(pi x / side) sin^2(pi y / side): 1 in a tile's middle, 0 on its border in value and slope."""
    s = np.sin(np.pi * points[:, :2].astype(float) / side) ** 2
    return s[:, 0] * s[:, 1]


def equalise_heights(
    tiles: list[list[GaussianField]], side: float
) -> tuple[list[list[GaussianField]], Float[Array, "tiles"]]:
    """Give all tiles the same mean height at the finest level; tiles[t][l] is level l of tile t.

    A rigid shift would tear borders apart, so a tile is raised by A_t bump(x, y) in all its levels alike; A_t makes
    the mean over its finest Gaussians that of all tiles. Returns the tiles and the A_t.
    """
    heights = [float(levels[0].means[:, 2].astype(float).mean()) for levels in tiles]
    goal = float(np.mean(heights))
    raised, amounts = [], []
    for levels, mean in zip(tiles, heights, strict=True):
        share = bump(levels[0].means, side).mean()
        amount = (goal - mean) / share if share > 0 else 0.0
        raised.append([_raise_tile(field, amount, side) for field in levels])
        amounts.append(amount)
    return raised, np.array(amounts)


def _raise_tile(field: GaussianField, amount: float, side: float) -> GaussianField:
    means = field.means.copy()
    means[:, 2] += (amount * bump(field.means, side)).astype(np.float32)
    return replace(field, means=means)
