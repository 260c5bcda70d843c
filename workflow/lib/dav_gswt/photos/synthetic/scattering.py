"""Where things grow on synthetic ground: patches, mats laid edge to edge, and things strewn one by one.

What grows where is told by rasters over a square of side PERIOD that repeats, 0 (nowhere) to 1 (everywhere). Things are
rows of x, y, size in metres and whether they follow the ground's slope (1) or stand upright (0), until `standing` sets
them on the ground.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import noise
from dav_gswt.photos.synthetic.land import Height, smoothstep, sown

PERIOD = 16.0  # metres after which what grows where repeats
CELLS = 512  # a side of such a raster: 3.1 cm a cell


def patches(rng: np.random.Generator, share: float, longest: float, shortest: float = 0.35) -> Float[Array, "n n"]:
    """1 in patches that hold about `share` of the ground, 0 elsewhere, smooth between.

    longest, shortest: wavelengths in metres of the patches and of their outlines' bays.
    """
    raster = noise.band(rng, CELLS, PERIOD, longest, shortest, 1.1)
    return smoothstep(*np.quantile(raster, [max(0.0, 1 - 1.6 * share), min(1.0, 1 - 0.4 * share)]), raster)


def at(raster: Float[Array, "n n"]) -> Height:
    """A raster as a function of places."""
    return lambda x, y: noise.sample(raster, PERIOD, x, y)


def thinning(density: Height, start: float, end: float) -> Height:
    """Less and less of it from `start` to `end` metres from the origin, where there is none."""
    return lambda x, y: density(x, y) * (1 - smoothstep(start, end, np.hypot(x, y)))


def laid(
    rng: np.random.Generator, density: Height, inner: float, outer: float, size: float, overlap: float = 0.26
) -> Float[Array, "n 4"]:
    """Mats of `size` on a jittered grid in a ring about the origin, left out as `density` falls from 1.

    overlap: share of a mat's size that its neighbour covers. They follow the slope.
    """
    spacing = (1 - overlap) * size
    axis = np.arange(-outer, outer, spacing)
    x, y = (v.ravel() + rng.uniform(-0.3, 0.3, v.size) * spacing for v in np.meshgrid(axis, axis))
    r = np.hypot(x, y)
    stays = (rng.uniform(size=x.size) < density(x, y)) & (r >= inner) & (r < outer)
    x, y = x[stays], y[stays]
    return np.column_stack([x, y, size * rng.uniform(0.85, 1.2, x.size), np.ones(x.size)])


def strewn(
    rng: np.random.Generator, where: Float[Array, "c c"], count: float, sizes: tuple[float, float], ends: float
) -> Float[Array, "n 4"]:
    """Upright things in proportion to the raster `where`, on average `count` on 100 square metres near the origin.

    ends: metres from the origin where the last stand; they thin out from 0.7 of that.
    """
    share = where * (count / 100 / max(where.mean(), 1e-9))
    places = sown(rng, thinning(at(share), 0.7 * ends, ends), share.max(), ends)
    return np.column_stack([places, rng.uniform(*sizes, len(places)), np.zeros(len(places))])


def standing(
    rng: np.random.Generator, which, found: Float[Array, "n 4"], height: Height, yaw: Float[Array, "n"] | None = None
) -> Float[Array, "n 8"]:
    """Rows of Land.places for things found at x, y: on the ground, turned by `yaw` radians or at random.

    Whatever follows the slope follows that over half its size.
    """
    x, y, size, lies = found.T
    reach = 0.5 * size + 0.01
    along_x = lies * (height(x + reach, y) - height(x - reach, y)) / (2 * reach)
    along_y = lies * (height(x, y + reach) - height(x, y - reach)) / (2 * reach)
    turn = rng.uniform(0, 2 * np.pi, len(x)) if yaw is None else yaw
    return np.column_stack([which, x, y, height(x, y), size, turn, along_x, along_y])
