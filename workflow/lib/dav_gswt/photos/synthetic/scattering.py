"""Where plants grow on synthetic ground: patches, mats side by side, and single plants.

Rasters over a repeating square of side PERIOD say what grows where, 0 (nowhere) to 1 (everywhere). Until `place_plants`
puts them on the ground, plants are rows of x, y, size in metres, and whether they follow the slope of the ground (1) or
stand upright (0).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import noise
from dav_gswt.photos.synthetic.land import Height, scatter_points, smoothstep
from dav_gswt.photos.synthetic.meshes import Mesh

PERIOD = 16.0  # metres
CELLS = 512  # per side of a raster: 3.1 cm a cell


@dataclass(frozen=True)
class PlantGroup:
    """Plants that share a choice of kinds. rows: see the module. yaw: radians; None: at random."""

    kinds: list[Mesh]
    rows: Float[Array, "n 4"]
    yaw: Float[Array, "n"] | None = None


def make_patches(rng: np.random.Generator, share: float, longest: float, shortest: float = 0.35) -> Float[Array, "n n"]:
    """1 in patches that hold about `share` of the ground, 0 elsewhere, smooth between.

    longest, shortest: wavelengths in metres of the patches and of their outlines.
    """
    raster = noise.make_noise(rng, CELLS, PERIOD, longest, shortest, 1.1)
    low, high = np.quantile(raster, [max(0.0, 1 - 1.6 * share), min(1.0, 1 - 0.4 * share)])
    return smoothstep(low, high, raster)


def interpolate(raster: Float[Array, "n n"]) -> Height:
    """A raster as a function of places."""
    return lambda x, y: noise.sample_raster(raster, PERIOD, x, y)


def fade_out(density: Height, start: float, end: float) -> Height:
    """A density that falls to 0 from `start` to `end` metres from the origin."""
    return lambda x, y: density(x, y) * (1 - smoothstep(start, end, np.hypot(x, y)))


def lay_mats(
    rng: np.random.Generator,
    density: Height,
    ring: tuple[float, float],
    size: float,
    overlap: float = 0.26,
    jitter: float = 0.3,
) -> Float[Array, "n 4"]:
    """Mats of `size` on a jittered grid in a ring about the origin; a mat is kept with probability `density`.

    overlap: share of a mat that its neighbour covers. jitter: in grid spacings. Mats follow the slope.
    """
    inner, outer = ring
    spacing = (1 - overlap) * size
    axis = np.arange(-outer, outer, spacing)
    x, y = (v.ravel() + rng.uniform(-jitter, jitter, v.size) * spacing for v in np.meshgrid(axis, axis))
    r = np.hypot(x, y)
    kept = (rng.uniform(size=x.size) < density(x, y)) & (r >= inner) & (r < outer)
    x, y = x[kept], y[kept]
    return np.column_stack([x, y, size * rng.uniform(0.85, 1.2, x.size), np.ones(x.size)])


def scatter_plants(
    rng: np.random.Generator,
    where: Float[Array, "c c"],
    count: float,
    sizes: tuple[float, float],
    fade: tuple[float, float],
    lies: float = 0.0,
) -> Float[Array, "n 4"]:
    """Single plants in proportion to the raster `where`, on average `count` per 100 square metres near the origin.

    fade: distances in metres from the origin between which they thin out. lies: 1: they follow the slope.
    """
    share = where * (count / 100 / max(where.mean(), 1e-9))
    places = scatter_points(rng, fade_out(interpolate(share), *fade), share.max(), fade[1])
    return np.column_stack([places, rng.uniform(*sizes, len(places)), np.full(len(places), lies)])


def place_plants(
    rng: np.random.Generator, groups: Iterable[PlantGroup], height: Height
) -> tuple[list[Mesh], Float[Array, "n 8"]]:
    """All kinds of plants, and the rows of Land.places. Each plant is of a random kind of its group."""
    plants, places = [], []
    for group in groups:
        which = len(plants) + rng.integers(0, len(group.kinds), len(group.rows))
        plants += group.kinds
        places.append(_place_group(rng, which, group, height))
    return plants, np.concatenate(places)


def _place_group(rng: np.random.Generator, which: Array, group: PlantGroup, height: Height) -> Float[Array, "n 8"]:
    """A plant that follows the slope follows that over half its size."""
    x, y, size, lies = group.rows.T
    reach = 0.5 * size + 0.01
    along_x = lies * (height(x + reach, y) - height(x - reach, y)) / (2 * reach)
    along_y = lies * (height(x, y + reach) - height(x, y - reach)) / (2 * reach)
    turn = rng.uniform(0, 2 * np.pi, len(x)) if group.yaw is None else group.yaw
    return np.column_stack([which, x, y, height(x, y), size, turn, along_x, along_y])
