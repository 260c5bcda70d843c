"""The land of a synthetic scene, and what its families share: relief, scattered stones and plants.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0. Rasters over a repeating square of
side PERIOD say what grows where, from 0 (nowhere) to 1 (everywhere). Until `place_plants` puts them on the ground,
plants are rows of x, y, size, and whether they follow the slope of the ground (1) or stand upright (0).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import meshes, noise
from dav_gswt.photos.synthetic.meshes import Mesh
from dav_gswt.photos.synthetic.noise import smoothstep

PERIOD = 16.0  # metres
CELLS = 512  # per side of a raster: 3.1 cm a cell
STONE_SQUARE = 16.0  # metres: side of the square about the origin that has stones
RGB = tuple[float, float, float]
Height = Callable[[Array, Array], Array]  # a value at x, y, such as the height of the ground


@dataclass(frozen=True)
class Light:
    """Sun and sky, in units of the exposure: irradiance across the beam and radiance; angles in degrees."""

    elevation: float  # of the sun
    azimuth: float  # of the sun, from +x towards +y
    sun: RGB
    zenith: RGB
    horizon: RGB
    below: Float[Array, "3"]  # below the horizon: light reflected by far ground


@dataclass(frozen=True)
class GroundLabels:
    """What a piece of land consists of.

    materials: numbers by name, from 1. material: the number at every place, over a square that repeats after `period`
    metres (as rasters do). objects: of each single thing, shrub or boulder, the vertices of its mesh above the ground.
    """

    materials: dict[str, int]
    material: Int[Array, "n n"]
    period: float
    objects: tuple[Float32[Array, "_ 3"], ...]


@dataclass(frozen=True)
class Land:
    """A piece of land ready to be rendered.

    ground: coloured by `albedo`, which repeats after `period` metres. plants: kinds, each about 1 high. places: one row
    per plant: its kind, x, y, z, size in metres, yaw in radians, and the slope along x and along y that it follows.
    labels: true materials and objects, where a family knows them.
    """

    ground: Mesh
    albedo: Float32[Array, "n n 3"]
    period: float
    stones: Mesh | None
    plants: list[Mesh]
    places: Float[Array, "m 8"]
    light: Light
    labels: GroundLabels | None = None


class Hills(NamedTuple):
    """Far hills: sine waves whose height is the product of two amplitudes.

    rise: distances from the origin between which they rise. waves: wave numbers along x and y, phase, weight.
    """

    rise: tuple[float, float]
    amplitudes: tuple[float, float]
    waves: tuple[tuple[float, float, float, float], ...]

    def height(self, x: Array, y: Array) -> Array:
        one, other = self.amplitudes
        far = smoothstep(*self.rise, np.hypot(x, y)) * one * other
        return far * sum(weight * np.sin(kx * x + ky * y + phase) for kx, ky, phase, weight in self.waves)


class FadingRaster(NamedTuple):
    """A repeating raster that fades to 0 from `start` to `end` metres from the origin."""

    raster: Float[Array, "n n"]
    start: float
    end: float

    def height(self, x: Array, y: Array, period: float = PERIOD) -> Array:
        return noise.sample_raster(self.raster, period, x, y) * (1 - smoothstep(self.start, self.end, np.hypot(x, y)))


def make_relief(large: FadingRaster, small: FadingRaster, hills: Hills) -> Height:
    """The height of the ground before levelling: two rasters near the origin, and far hills."""
    return lambda x, y: large.height(x, y) + small.height(x, y) + hills.height(x, y)


def add_mounds(
    z: Array, x: Array, y: Array, plants: Float[Array, "m 3"], height: float, width: float, end: float
) -> Array:
    """Heights with a mound of earth at every plant x, y, size: height exp(-r^2 / width^2).

    height, width, end: in sizes of the plant; end: distance, summed along x and y, from which there is none.
    """
    out = z.copy()
    for px, py, size in plants:
        near = np.abs(x - px) + np.abs(y - py) < end * size
        square = (x[near] - px) ** 2 + (y[near] - py) ** 2
        out[near] += height * size * np.exp(-square / (width * size) ** 2)
    return out


def level_ground(height: Height, exemplar: float) -> Height:
    """The ground moved in height so that its mean over the exemplar is 0."""
    grid = np.linspace(-exemplar / 2, exemplar / 2, 256)
    level = height(*np.meshgrid(grid, grid)).mean()
    return lambda x, y: height(x, y) - level


def make_ground_mesh(height: Height) -> Mesh:
    """The mesh of the ground: a grid that is fine about the origin and grows coarser towards the horizon."""
    fine, reach, growth = 0.022, 7.0, 1.06
    outer = reach + np.cumsum(fine * growth ** np.arange(1, 125))
    axis = np.concatenate([-outer[::-1], np.linspace(-reach, reach, round(2 * reach / fine) + 1), outer])
    x, y = np.meshgrid(axis, axis)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    vertices = np.stack([x, y, height(x, y)], -1).reshape(-1, 3).astype(np.float32)
    return Mesh(vertices, faces, None, smooth=True)


def scatter_stones(
    rng: np.random.Generator, large: float, small: float, height: Height, colours: meshes.Colours
) -> Mesh:
    """Stones of 3 to 25 cm and pebbles as one mesh, sunk a little into the ground.

    large, small: how many of either per 100 square metres.
    """
    big = scatter_disjoint(rng, large, STONE_SQUARE, 0.03, 0.25, 1.75)
    little = scatter_disjoint(rng, small, STONE_SQUARE, 0.010, 0.032, 2.5)
    stones = [meshes.make_stone(rng, 3, colours) for _ in range(14)]
    pebbles = [meshes.make_stone(rng, 1, colours) for _ in range(24)]
    found = []
    for places, kinds in ((big, stones), (little, pebbles)):
        found += lay_stones(rng, places, kinds, height(places[:, 0], places[:, 1]) + 0.10 * places[:, 2])
    return meshes.merge_meshes(found)


def lay_stones(rng: np.random.Generator, places: Float[Array, "n 3"], kinds: list[Mesh], z) -> list[Mesh]:
    """A stone of a random kind at each row of x, y and size, with its centre at the height z."""
    return [
        meshes.transform_mesh(kinds[rng.integers(len(kinds))], (x, y, up), size, rng.uniform(0, 2 * np.pi))
        for (x, y, size), up in zip(places, z, strict=True)
    ]


def scatter_disjoint(
    rng: np.random.Generator, density: float, side: float, least: float, most: float, steep: float
) -> Float[Array, "n 3"]:
    """x, y and size of objects on a square of `side` about the origin, in loose groups and without overlap.

    density: per 100 square metres. Sizes: as of `meshes.draw_sizes`. An object without a free place in 12 tries is left
    out.
    """
    count = round(density * side * side / 100)
    sizes = np.sort(meshes.draw_sizes(rng, count, least, most, steep))[::-1]
    groups = rng.uniform(-side / 2, side / 2, (max(1, count // 9), 2))
    taken = np.zeros((0, 3))
    for size in sizes:
        for _ in range(12):
            at = rng.uniform(-side / 2, side / 2, 2)
            if rng.uniform() < 0.45:
                at = groups[rng.integers(len(groups))] + rng.normal(0, 0.06 * side, 2)
            if np.abs(at).max() > side / 2:
                continue
            if not (np.hypot(*(taken[:, :2] - at).T) < 0.75 * (taken[:, 2] + size)).any():
                taken = np.vstack([taken, [*at, size]])
                break
    return taken


def scatter_points(rng: np.random.Generator, density: Height, most: float, reach: float) -> Float[Array, "n 2"]:
    """Random places x, y within `reach` of the origin, `density(x, y)` per square metre.

    Candidates of the density `most`, which `density` never exceeds, are thinned: a Poisson process but for its number.
    """
    candidates = rng.uniform(-reach, reach, (round(most * (2 * reach) ** 2), 2))
    kept = rng.uniform(0, most, len(candidates)) < density(*candidates.T)
    return candidates[kept & (np.hypot(*candidates.T) < reach)]


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


class PlantGroup(NamedTuple):
    """Plants that share a choice of kinds. rows: see the module."""

    kinds: list[Mesh]
    rows: Float[Array, "n 4"]


def place_plants(
    rng: np.random.Generator, groups: Iterable[PlantGroup], height: Height
) -> tuple[list[Mesh], Float[Array, "n 8"]]:
    """All kinds of plants, and the rows of Land.places.

    Each plant is of a random kind of its group. A plant that follows the slope follows the slope over half its size.
    """
    plants, places = [], []
    for kinds, rows in groups:
        which = len(plants) + rng.integers(0, len(kinds), len(rows))
        plants += kinds
        x, y, size, lies = rows.T
        reach = 0.5 * size + 0.01
        along_x = lies * (height(x + reach, y) - height(x - reach, y)) / (2 * reach)
        along_y = lies * (height(x, y + reach) - height(x, y - reach)) / (2 * reach)
        turn = rng.uniform(0, 2 * np.pi, len(x))
        places.append(np.column_stack([which, x, y, height(x, y), size, turn, along_x, along_y]))
    return plants, np.concatenate(places)


def stand_upright(rng: np.random.Generator, which, x, y, z, size) -> Float[Array, "n 8"]:
    """Rows of Land.places of things with a random yaw that do not follow the slope."""
    return np.column_stack([which, x, y, z, size, rng.uniform(0, 2 * np.pi, len(x)), np.zeros((len(x), 2))])
