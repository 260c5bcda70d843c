"""Whether a terrain repeats visibly: how its picture from above resembles itself a tile away.

- Lattice excess: the autocorrelation at whole tiles less that half a tile to either side, averaged over both axes, of
  brightness and of landmarks (places that stand out of their surroundings).
- Busyness: share of the variance of brightness that whole cells explain, each by its mean. Patches of materials are as
  wide as some cells, so it says little about ground of several.
- Mean tile: share of the variance that the place within a cell explains: what all cells have in common.

Brightness is that of the picture without what is wider than the lattice: patches of materials are no repetition.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.geometry import cameras
from dav_gswt.raster import render
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, list_cells, place_block

TILES = 20  # a side of the picture
PIXELS = 32  # a side of a tile
STRIP = 5  # rows of cells that are rendered at once
WIDE = 2.0  # of a tile: blur of what is wider than the lattice
SPOT, AROUND = 1 / 24, 1 / 8  # of a tile: blurs whose difference shows landmarks
OUTSTANDING = 2.5  # robust standard deviations from which a place is a landmark
WHOLE, HALF = (1.0, 2.0), (0.5, 1.5, 1.5, 2.5)  # lags in tiles


@dataclass(frozen=True)
class LatticeMeasures:
    """brightness, landmarks: lattice excess of each; 0 without landmarks. busyness, mean_tile: in [0, 1]. next:
    autocorrelation of brightness one tile away, the mean of both axes.
    """

    brightness: float
    landmarks: float
    busyness: float
    mean_tile: float
    next: float


def render_from_above(
    terrain: EndlessTerrain, level: int, tiles: int = TILES, pixels: int = PIXELS
) -> Float32[Array, "h w 3"]:
    """Orthographic picture of `tiles` x `tiles` cells from the cell (0, 0), north up."""
    step = terrain.side / pixels
    strips = []
    for row in range(0, tiles, STRIP):
        rows = min(STRIP, tiles - row)
        cells = list_cells(terrain, Area(-1, row - 1, tiles + 2, rows + 2))  # what reaches over the edges, too
        field = place_block(terrain, cells, level, np.array([-terrain.side, (row - 1) * terrain.side, 0.0]))()
        top = float(field.means[:, 2].max()) + 10 * terrain.side
        camera = cameras.top_down(terrain.side, terrain.side, tiles * pixels, rows * pixels, step, top)
        strips.append(render(field, camera).colour)
    return np.concatenate(strips[::-1])


def take_material(terrain: EndlessTerrain, number: int) -> EndlessTerrain:
    """A terrain of one material's tiles alone, everywhere and without objects: borders and patches of several hide a
    lattice from the measures."""
    each = terrain.tiles_each
    first, last = number * each, (number + 1) * each
    tiles = {(level, tile - first): field for (level, tile), field in terrain.tiles.items() if first <= tile < last}
    orders = terrain.tile_orders[first:last]
    return replace(terrain, tiles=tiles, tile_orders=orders, classes=None, objects=[], extents=[], scatter=None)


def choose_level(terrain: EndlessTerrain, pixels: int = PIXELS) -> int:
    """The coarsest level whose Gaussians are mostly narrower than a pixel, or the finest one."""
    step = terrain.side / pixels
    levels = range(len(terrain.switches))
    widths = [np.median(np.exp(terrain.tiles[level, 0].log_scales.max(1))) for level in levels]
    return max([level for level in levels if widths[level] <= step], default=0)


def measure_lattice(picture: Float[Array, "h w 3"], pixels: int = PIXELS) -> LatticeMeasures:
    """The measures of a picture from above, of `pixels` a tile."""
    bright = picture.astype(float).mean(-1)
    local = bright - gaussian_filter(bright, WIDE * pixels, mode="reflect")
    marks = find_landmarks(bright, pixels)
    r = autocorrelate(local[..., None])
    following = _mean_at(r, (1.0,), pixels)
    found = measure_excess(autocorrelate(marks[..., None].astype(float)), pixels) if marks.any() else 0.0
    busyness, mean_tile = explain_variance(local, pixels)
    return LatticeMeasures(measure_excess(r, pixels), found, busyness, mean_tile, following)


def autocorrelate(picture: Float[Array, "h w c"]) -> Float[Array, "h1 w1"]:
    """Autocorrelation at all lags up to the picture's size, lag 0 in the middle; 0 for a picture of one colour.

    r(d) = mean over x of (f(x) - m)(f(x + d) - m) / variance, summed over colour channels, where x and x + d are both
    in the picture: 1 at d = 0.
    """
    f = picture - picture.mean((0, 1))
    shape = [2 * n for n in f.shape[:2]]
    power = (np.abs(np.fft.rfft2(f, shape, (0, 1))) ** 2).sum(-1)
    total = np.fft.fftshift(np.fft.irfft2(power, shape))
    (h, w), variance = f.shape[:2], float((f**2).sum(-1).mean())
    pairs = np.outer(h - np.abs(np.arange(-h, h)), w - np.abs(np.arange(-w, w)))
    return total / np.maximum(pairs, 1) / variance if variance > 1e-12 else np.zeros_like(total)


def measure_excess(r: Float[Array, "h w"], pixels: int) -> float:
    """The autocorrelation at whole tiles less that at half tiles."""
    return _mean_at(r, WHOLE, pixels) - _mean_at(r, HALF, pixels)


def _mean_at(r: Float[Array, "h w"], lags: tuple[float, ...], pixels: int) -> float:
    middle = r.shape[0] // 2, r.shape[1] // 2
    steps = [round(lag * pixels) for lag in lags]
    east = [r[middle[0], middle[1] + step] for step in steps]
    north = [r[middle[0] + step, middle[1]] for step in steps]
    return float(np.mean([east, north]))


def find_landmarks(bright: Float[Array, "h w"], pixels: int) -> Bool[Array, "h w"]:
    """Places that stand out of their surroundings."""
    spots = gaussian_filter(bright, SPOT * pixels) - gaussian_filter(bright, AROUND * pixels)
    away = np.abs(spots - np.median(spots))
    spread = 1.4826 * float(np.median(away))
    return away > OUTSTANDING * spread if spread > 0 else np.zeros(bright.shape, bool)


def explain_variance(local: Float[Array, "h w"], pixels: int) -> tuple[float, float]:
    """Shares of the variance that the means of cells explain, and that the mean cell explains."""
    rows, columns = local.shape[0] // pixels, local.shape[1] // pixels
    cells = local[: rows * pixels, : columns * pixels].reshape(rows, pixels, columns, pixels)
    variance = max(float(local.var()), 1e-12)
    return float(cells.mean((1, 3)).var() / variance), float(cells.mean((0, 2)).var() / variance)
