"""Plane sweep: the heights of objects above the ground's surface, by photo consistency.

For every cell and height above the surface the photos that see the point are compared: they agree where a surface is.
This finds trees, shrubs and stones even in photos straight from above, and relief that the sparse points of structure
from motion miss. Photos also agree by chance on uniform ground; but an object there would hide ground that they agree
on as well, which rules it out (`photo_colours.median_behind`). Costs are summed along rows and columns as in
semi-global matching (Hirschmueller 2008), so that ground without texture takes the height of its neighbours.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter, label

from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import photo_colours
from dav_gswt.reconstruction.ground import Ground

MAX_CELLS = 60_000  # of the sweep's own grid
LOW, HIGH = -0.02, 0.3  # heights tried, in flying heights over the surface
WINDOW = 2.0  # cells: standard deviation of the window over which photos are compared
ONE_STEP, MORE_STEPS = 0.01, 0.06  # cost of a change of height by one step, by more, between cells
AIR_COST = 0.01  # of any height above the surface
MAX_COST = 0.8  # of an object, in costs of the surface
UNKNOWN_COST = 0.3  # where fewer than two photos look
SUPPORT = 0.7  # of the photos that see the surface must see a height above it
MIN_PHOTOS = 3  # that must agree on an object: two agree anywhere along a stripe
SLANT = 2.0  # run over fall of a ray: how far beyond the grid (half of it at most) the ground is compared too
MAX_SLENDERNESS = 4.0  # height over width of an object: more is a wrong match
THREADS = 4  # at most; changes no result
AT_ONCE = 32  # heights, so that their sums stay below 40 MB
OBJECT_STEPS = 2.0  # steps above the surface, beyond which a height belongs to an object


@dataclass(frozen=True)
class Relief:
    """The result of the sweep, on a grid coarser than the ground's.

    above: height over the surface. stands: whether an object is there.
    """

    grid: Ground
    above: Float[Array, "rows columns"]
    stands: Bool[Array, "rows columns"]
    step: float

    def onto(self, grid: Ground, values: Float[Array, "rows columns"]) -> Float[Array, "r c"]:
        """Values of the sweep's cells at the cells of another grid over the same ground, bilinear."""
        return replace(self.grid, heights=values.astype(float)).height_at(grid.centres).reshape(grid.shape)


def sweep_heights(grid: Ground, views: list[TrainingView], flying_height: float, pixel: float) -> Relief:
    """Sweep heights LOW to HIGH over the grid's surface, in steps of `pixel`, a pixel's size on the ground."""
    stride = max(1, int(np.ceil(np.sqrt(grid.heights.size / MAX_CELLS))))
    coarse = coarsen_grid(grid, stride)
    step = max(pixel, coarse.spacing / 2)
    heights = step * np.arange(np.floor(LOW * flying_height / step), np.ceil(HIGH * flying_height / step) + 1)
    costs, photos = measure_disagreement(coarse, views, heights)
    known = photos >= 2
    surface = int(np.abs(heights).argmin())
    reject_seen_through(costs, coarse, views, heights, costs[surface].copy(), OBJECT_STEPS * step)
    in_air = (np.abs(heights) > OBJECT_STEPS * step)[:, None, None] * np.float32(AIR_COST)
    summed = aggregate_costs(costs + in_air, ONE_STEP, MORE_STEPS)
    best = summed.argmin(0)
    cost = np.take_along_axis(costs, best[None], 0)[0]
    sure = (photos >= MIN_PHOTOS) & (cost <= MAX_COST * costs[surface])
    above = np.where(known, _refine_heights(summed, best, heights), 0)
    stands = reject_columns(sure & (above > OBJECT_STEPS * step), above, coarse.spacing)
    near = np.abs(above) <= OBJECT_STEPS * step
    return Relief(coarse, np.where(stands | near, above, 0), stands, step)


def reject_columns(
    stands: Bool[Array, "rows columns"], above: Float[Array, "rows columns"], cell: float
) -> Bool[Array, "rows columns"]:
    """The cells without columns in the air: a cell is at most MAX_SLENDERNESS times as high as the patch is wide whose
    cells are at least as high, within a factor of two. above: positive where an object stands."""
    found, low = stands.copy(), above[stands].min(initial=np.inf)
    while (band := stands & (above >= low)).any():
        patch, count = label(band, np.ones((3, 3)))
        wide = cell * np.sqrt(np.bincount(patch.ravel(), minlength=count + 1))
        found &= ~(band & (above < 2 * low) & (above > MAX_SLENDERNESS * wide[patch]))
        low *= 2
    return found


def coarsen_grid(grid: Ground, stride: int) -> Ground:
    """A grid over (nearly) the same ground whose cells are `stride` times as wide."""
    rows, columns = (max(1, n // stride) for n in grid.shape)
    part = grid.heights[: rows * stride, : columns * stride]
    heights = part.reshape(rows, stride, columns, stride).mean((1, 3))
    return replace(grid, spacing=stride * grid.spacing, heights=heights, seen=np.zeros(heights.shape, bool))


def pad_grid(grid: Ground, cells: int) -> Ground:
    """The grid with so many more cells on every side, as high as its border."""
    off = cells * grid.spacing
    block = {"first_row": grid.first_row + cells, "first_column": grid.first_column + cells}
    maps = {"heights": np.pad(grid.heights, cells, mode="edge"), "seen": np.pad(grid.seen, cells)}
    return replace(grid, west=grid.west - off, south=grid.south - off, **block, **maps)


def measure_disagreement(
    grid: Ground, views: list[TrainingView], heights: Float[Array, "h"]
) -> tuple[Float32[Array, "h rows columns"], Float32[Array, "rows columns"]]:
    """Standard deviation of the photos' colours at each height over each cell, averaged over a window of cells, and the
    number of photos that see each cell's surface.

    A height that far fewer photos see than the surface below it costs UNKNOWN_COST: few photos agree by chance.
    """
    places, levels = grid.centres.astype(np.float32), heights.astype(np.float32)
    number = photo_colours.sum_colours(views, places, np.zeros(1, np.float32)).count[0]
    least = np.maximum(2, SUPPORT * number)

    def average(spread: Float32[Array, "n"], count: Float32[Array, "n"]) -> Array:
        spread, seen = (a.reshape(grid.shape) for a in (spread, count >= least))
        weight = gaussian_filter(seen.astype(np.float32), WINDOW, mode="nearest")
        mean = gaussian_filter(np.where(seen, spread, 0), WINDOW, mode="nearest") / np.maximum(weight, 1e-6)
        return np.where(seen, mean, np.float32(UNKNOWN_COST))

    costs = []
    with ThreadPoolExecutor(THREADS) as pool:  # SciPy works beside itself; each height is on its own
        for start in range(0, len(levels), AT_ONCE):
            sums = photo_colours.sum_colours(views, places, levels[start : start + AT_ONCE])
            costs += pool.map(average, sums.deviations(), sums.count)
    return np.stack(costs).astype(np.float32, copy=False), number.reshape(grid.shape)


def reject_seen_through(
    costs: Float32[Array, "h rows columns"],
    grid: Ground,
    views: list[TrainingView],
    heights: Float[Array, "h"],
    surface: Float32[Array, "rows columns"],
    lowest: float,
) -> None:
    """Set the cost of heights above `lowest` to UNKNOWN_COST where the photos see through: an object there would hide
    ground that they agree on nearly as well as on the object, or too few photos see ground behind it.

    surface: cost of the ground. Changes costs in place.
    """
    around = pad_grid(grid, min(int(np.ceil(SLANT * heights.max() / grid.spacing)), min(grid.shape) // 2))
    (ground,), photos = measure_disagreement(around, views, np.zeros(1))
    ground = np.where(photos >= 2, ground, np.float32(np.nan))
    places = grid.centres.astype(np.float32)

    def at(height: float, cost: Float32[Array, "rows columns"]) -> None:
        rows = np.flatnonzero(cost <= MAX_COST * surface)  # elsewhere nothing would stand anyway
        behind = photo_colours.median_behind(
            around, ground, places[rows] + np.array([0, 0, height], np.float32), views, MIN_PHOTOS
        )
        cost.ravel()[rows[~(cost.ravel()[rows] <= MAX_COST * behind)]] = UNKNOWN_COST

    over = np.flatnonzero(heights > lowest)
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(at, heights[over].tolist(), costs[over[0] :] if len(over) else []))


def aggregate_costs(
    costs: Float32[Array, "h rows columns"], one: float, more: float
) -> Float32[Array, "h rows columns"]:
    """Sum over four directions of the least cost of a path of heights that ends in a cell.

    L(p, h) = C(p, h) + min(L(q, h), L(q, h +- 1) + one, min over g of L(q, g) + more) - min over g of L(q, g), q: the
    cell before p.
    """
    total = np.zeros_like(costs)
    for axis in (1, 2):
        lines, sums = np.moveaxis(costs, axis, 0), np.moveaxis(total, axis, 0)
        for order in (range(len(lines)), range(len(lines) - 1, -1, -1)):
            before = None
            for i in order:
                now = lines[i]
                if before is not None:
                    least = before.min(0)
                    best = np.minimum(before, least + np.float32(more))
                    np.minimum(best[1:], before[:-1] + np.float32(one), out=best[1:])
                    np.minimum(best[:-1], before[1:] + np.float32(one), out=best[:-1])
                    now = now + best - least
                sums[i] += now
                before = now
    return total


def _refine_heights(
    costs: Float32[Array, "h rows columns"], best: Array, heights: Array
) -> Float[Array, "rows columns"]:
    """The height of the parabola's minimum through the best cost and its two neighbours."""
    middle = np.clip(best, 1, len(heights) - 2)
    low, at, high = (np.take_along_axis(costs, (middle + k)[None], 0)[0].astype(float) for k in (-1, 0, 1))
    off = 0.5 * (low - high) / np.maximum(low - 2 * at + high, 1e-9)
    return heights[middle] + np.clip(off, -0.5, 0.5) * (heights[1] - heights[0])
