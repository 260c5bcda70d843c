"""The ground: a height field on a regular grid with one disc a cell.

Rows run from south to north and columns from west to east, in memory; on disk (EXR) the first row is the northern one,
as in any image of a map. The exemplar is a square block of whole cells, so that tiles cut from it stay on the grid.
"""

from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates
from scipy.sparse import coo_matrix, diags, identity, kron
from scipy.sparse.linalg import spsolve

from dav_gswt.arrays import measure_slopes
from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files

NODES = 96  # knots of the height surface along the longer side: what sparse points can carry
MARGIN = 0.15  # ground modelled around what tiles are cut from, as a share of the exemplar's side
FAR = 0.5  # beyond this share of it, ground is modelled for its own sake
WHOLE = 10.0  # such a margin, where all ground that the photos see is modelled
STIFFNESS = 0.05  # weight of the bending energy against one point a knot
LENGTHS, COUNTS = ("west", "south", "spacing"), ("first_row", "first_column", "cells")  # in the header of ground.exr


@dataclass(frozen=True)
class Ground:
    """A height field over cells of side `spacing`, from the corner (west, south).

    seen: at least one captured photo looks at the cell. first_row, first_column, cells: the exemplar's block.
    """

    west: float
    south: float
    spacing: float
    first_row: int
    first_column: int
    cells: int
    heights: Float[Array, "rows columns"]
    seen: Bool[Array, "rows columns"]

    @property
    def shape(self) -> tuple[int, int]:
        return self.heights.shape

    @property
    def centres(self) -> Float[Array, "n 3"]:
        """World positions of the cells' centres on the surface, row by row."""
        rows, columns = self.shape
        x = self.west + (np.arange(columns) + 0.5) * self.spacing
        y = self.south + (np.arange(rows) + 0.5) * self.spacing
        x, y = np.meshgrid(x, y)
        return np.stack([x.ravel(), y.ravel(), self.heights.ravel()], 1)

    @property
    def exemplar(self) -> tuple[float, float, float]:
        """West, south and side of the exemplar in world units."""
        return (
            self.west + self.first_column * self.spacing,
            self.south + self.first_row * self.spacing,
            self.cells * self.spacing,
        )

    @property
    def judged(self) -> tuple[float, float, float, float]:
        """West, south, east and north of the ground that scores and errors are about: the exemplar, or, where far more
        than its margin is modelled, all but that margin at the border, which photos hardly see."""
        west, south, side = self.exemplar
        low, high = np.array([west, south]), np.array([west, south]) + side
        first = np.array([self.west, self.south])
        last = first + self.spacing * np.array(self.shape[::-1])
        if max((low - first).max(), (last - high).max()) > FAR * side:
            low, high = np.minimum(low, first + MARGIN * side), np.maximum(high, last - MARGIN * side)
        return (*low.tolist(), *high.tolist())

    def slopes(self) -> tuple[Float[Array, "rows columns"], Float[Array, "rows columns"]]:
        """Rise of the surface to the east and to the north, by central differences."""
        return measure_slopes(self.heights, self.spacing)

    def height_at(self, points: Float[Array, "n d"]) -> Float[Array, "n"]:
        """Height of the surface under points, bilinear; beyond the grid the border's height goes on."""
        row = (points[:, 1] - self.south) / self.spacing - 0.5
        column = (points[:, 0] - self.west) / self.spacing - 0.5
        return map_coordinates(self.heights, [row, column], order=1, mode="nearest")

    def contains(self, points: Float[Array, "n d"]) -> Bool[Array, "n"]:
        """Which points lie over the grid."""
        rows, columns = self.shape
        x, y = points[:, 0] - self.west, points[:, 1] - self.south
        return (x >= 0) & (y >= 0) & (x <= columns * self.spacing) & (y <= rows * self.spacing)


def fit_ground(
    frame: SceneFrame, points: Float[Array, "n 3"], spacing: float, max_cells: int, block: int, margin: float
) -> Ground:
    """Place the grid over the exemplar and a margin around it, and fit the surface to the points.

    spacing: of the discs, in world units; widened where more than `max_cells` cells would be needed.
    block: the exemplar's side becomes a multiple of it, in cells. margin: ground kept around the exemplar, as a share
    of its side, as far as a photo sees any.
    Raises: InputError: the exemplar is too small for one block.
    """
    west, south, side, extent = frame.exemplar.west, frame.exemplar.south, frame.exemplar.side, frame.extent
    reach = margin * side
    low = max(extent.west, west - reach), max(extent.south, south - reach)
    high = min(extent.east, west + side + reach), min(extent.north, south + side + reach)
    around = *low, *high
    area = (around[2] - around[0]) * (around[3] - around[1])
    spacing = max(spacing, float(np.sqrt(area / max_cells)))
    cells = int(side / spacing) // block * block
    if cells < block:
        raise InputError(
            f"the well-seen square of ground is {side / spacing:.0f} discs wide and the levels need {block}: "
            "take more photos, or set fewer `levels` or a finer preset"
        )
    inset = 0.5 * (side - cells * spacing)
    left = max(0, int((west + inset - around[0]) / spacing))
    below = max(0, int((south + inset - around[1]) / spacing))
    right = max(0, int((around[2] - west - inset) / spacing) - cells)
    above = max(0, int((around[3] - south - inset) / spacing) - cells)
    shape = (below + cells + above, left + cells + right)
    corner = west + inset - left * spacing, south + inset - below * spacing
    grid = Ground(*corner, spacing, below, left, cells, np.zeros(shape), np.zeros(shape, bool))
    return replace(grid, heights=fit_surface(grid, points))


def fit_surface(grid: Ground, points: Float[Array, "n 3"]) -> Float[Array, "rows columns"]:
    """A smooth surface through points over the grid: least bending, robust against points that stand out.

    Minimises sum_p w_p (h(x_p) - z_p)^2 + STIFFNESS |second differences of h|^2 on NODES knots with bilinear
    interpolation; the weights w_p are Geman-McClure's at twice the residuals' median, re-estimated five times.
    Without points the ground is flat.
    """
    rows, columns = grid.shape
    points = points[grid.contains(points)]
    if len(points) < 3:
        return np.zeros((rows, columns))
    step = max(rows, columns) / NODES
    ny, nx = max(4, round(rows / step)), max(4, round(columns / step))
    v = np.clip((points[:, 1] - grid.south) / (rows * grid.spacing) * (ny - 1), 0, ny - 1.000001)
    u = np.clip((points[:, 0] - grid.west) / (columns * grid.spacing) * (nx - 1), 0, nx - 1.000001)
    sample = _bilinear(v, u, ny, nx)
    first, second = ([np.diff(np.eye(n), order, axis=0) for n in (ny, nx)] for order in (1, 2))
    bend = kron(identity(ny), second[1]), kron(second[0], identity(nx)), 2 * kron(first[0], first[1])
    stiff = STIFFNESS * reduce(add, (b.T @ b for b in bend)) + 1e-9 * identity(ny * nx)
    z, weight, knots = points[:, 2], np.ones(len(points)), np.zeros(ny * nx)
    for _ in range(5):
        w = diags(weight)
        knots = spsolve((sample.T @ w @ sample + stiff).tocsc(), sample.T @ (weight * z))
        residual = np.abs(sample @ knots - z)
        scale = 2 * np.median(residual) + 1e-12
        weight = 1 / (1 + (residual / scale) ** 2) ** 2
    row = (np.arange(rows) + 0.5) / rows * (ny - 1)
    column = (np.arange(columns) + 0.5) / columns * (nx - 1)
    return map_coordinates(knots.reshape(ny, nx), np.meshgrid(row, column, indexing="ij"), order=1, mode="nearest")


def _bilinear(v, u, ny: int, nx: int):
    i, j = v.astype(int), u.astype(int)
    fv, fu = v - i, u - j
    p = np.arange(len(v))
    values = np.concatenate([(1 - fv) * (1 - fu), (1 - fv) * fu, fv * (1 - fu), fv * fu])
    knots = np.concatenate([i * nx + j, i * nx + j + 1, (i + 1) * nx + j, (i + 1) * nx + j + 1])
    return coo_matrix((values, (np.tile(p, 4), knots)), shape=(len(v), ny * nx)).tocsr()


def write_ground(grid: Ground, path: Path | str) -> None:
    """Write heights and the seen cells as the channels Z and seen of an EXR, the grid's place in its header."""
    image_files.write_exr(
        path,
        {"Z": grid.heights[::-1].astype(np.float32), "seen": grid.seen[::-1].astype(np.float32)},
        {f"ground_{k}": repr(getattr(grid, k)) for k in (*LENGTHS, *COUNTS)},
    )


def read_ground(path: Path | str) -> Ground:
    """Read a ground; heights have the stored precision, float32.

    Raises: InputError: not readable, or not a ground.
    """
    channels, header = image_files.read_exr(path)
    try:
        number = {k: float(header[f"ground_{k}"]) for k in LENGTHS}
        count = {k: int(header[f"ground_{k}"]) for k in COUNTS}
        heights, seen = channels["Z"][::-1].astype(float), channels["seen"][::-1] > 0.5
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: not the grid of a ground ({error}); fit the field again") from error
    return Ground(**number, **count, heights=heights, seen=seen)
