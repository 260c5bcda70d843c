"""The land of a synthetic scene, and what its families share: options, relief and scattered stones.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.photos.synthetic import meshes, noise
from dav_gswt.photos.synthetic.labels import GroundLabels
from dav_gswt.photos.synthetic.meshes import Mesh

STONE_SQUARE = 16.0  # metres: side of the square about the origin that has stones
Height = Callable[[Array, Array], Array]  # a value at x, y, such as the height of the ground
Wave = tuple[float, float, float, float]  # of far hills: wave numbers along x and y, phase, weight


@dataclass(frozen=True)
class Light:
    """Sun and sky, in units of the exposure: irradiance across the beam and radiance; angles in degrees."""

    elevation: float  # of the sun
    azimuth: float  # of the sun, from +x towards +y
    sun: Float[Array, "3"]
    zenith: Float[Array, "3"]
    horizon: Float[Array, "3"]
    below: Float[Array, "3"]  # below the horizon: light reflected by far ground


@dataclass(frozen=True)
class Land:
    """A piece of land ready to be rendered.

    ground: coloured by `albedo`, which repeats after `period` metres. plants: kinds, each about 1 high. places: one row
    per plant: its kind, x, y, z, size in metres, yaw in radians, and the ground's slope along x and along y that it
    follows (0 0: it is upright). labels: true materials and objects, where a family knows them.
    """

    ground: Mesh
    albedo: Float32[Array, "n n 3"]
    period: float
    stones: Mesh | None
    plants: list[Mesh]
    places: Float[Array, "m 8"]
    light: Light
    labels: GroundLabels | None = None


@dataclass(frozen=True)
class FamilyOptions:
    """Base of the options of a family: numbers, each with bounds (see `option`)."""


Options = TypeVar("Options", bound=FamilyOptions)


def option(default: float, least: float, most: float) -> Any:
    """A field of FamilyOptions."""
    return field(default=default, metadata={"bounds": (least, most)})


def option_bounds(options: type[FamilyOptions]) -> dict[str, tuple[float, float]]:
    """The least and the greatest value of every option."""
    return {f.name: f.metadata["bounds"] for f in fields(options)}


def make_options(family: str, kind: type[Options], given: dict[str, Any]) -> Options:
    """The options of a family with some values given.

    Raises: InputError: an unknown name or a value out of bounds, by name.
    """
    bounds = option_bounds(kind)
    for name, value in given.items():
        if name not in bounds:
            raise InputError(f"{family}: there is no option {name!r}; it has {', '.join(bounds)}")
        low, high = bounds[name]
        if not isinstance(value, int | float) or isinstance(value, bool) or not low <= value <= high:
            raise InputError(f"{family}: {name} is {value!r}; it must be a number from {low} to {high}")
    return kind(**{f.name: float(given.get(f.name, f.default)) for f in fields(kind)})


def fade_raster(raster: Float[Array, "n n"], period: float, x: Array, y: Array, start: float, end: float) -> Array:
    """A repeating raster that fades to 0 from `start` to `end` metres from the origin."""
    return noise.sample_raster(raster, period, x, y) * (1 - smoothstep(start, end, np.hypot(x, y)))


def sum_hills(x: Array, y: Array, rise: tuple[float, float], amplitudes: tuple[float, float], waves: Sequence[Wave]):
    """Far hills: sine waves times the product of `amplitudes`, rising between two distances from the origin."""
    one, other = amplitudes
    far = smoothstep(*rise, np.hypot(x, y)) * one * other
    return far * sum(weight * np.sin(kx * x + ky * y + phase) for kx, ky, phase, weight in waves)


def add_mounds(
    z: Array, x: Array, y: Array, plants: Float[Array, "m 3"], height: float, width: float, end: float
) -> Array:
    """Heights with a mound of earth at every plant x, y, size: height exp(-r^2 / width^2).

    height, width, end: in sizes of the plant; end: distance, summed along x and y, from which there is none.
    """
    order = np.argsort(x, axis=None)
    sorted_x, at_x, at_y, out = x.ravel()[order], x.ravel(), y.ravel(), z.ravel().copy()
    for px, py, size in plants:
        some = order[slice(*np.searchsorted(sorted_x, [px - end * size, px + end * size]))]
        near = some[np.abs(at_x[some] - px) + np.abs(at_y[some] - py) < end * size]
        square = (at_x[near] - px) ** 2 + (at_y[near] - py) ** 2
        out[near] += height * size * np.exp(-square / (width * size) ** 2)
    return out.reshape(z.shape)


def level_ground(height: Height, exemplar: float) -> Height:
    """The ground moved in height so that its mean over the exemplar is 0."""
    grid = np.linspace(-exemplar / 2, exemplar / 2, 256)
    level = height(*np.meshgrid(grid, grid)).mean()
    return lambda x, y: height(x, y) - level


def make_ground_mesh(height: Height) -> Mesh:
    """The mesh of the ground: a grid that is fine about the origin and grows coarser towards the horizon."""
    fine, reach, growth = 0.022, 7.0, 1.06
    steps = fine * growth ** np.arange(1, 125)
    outer = reach + np.cumsum(steps)
    axis = np.concatenate([-outer[::-1], np.linspace(-reach, reach, round(2 * reach / fine) + 1), outer])
    x, y = np.meshgrid(axis, axis)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    vertices = np.stack([x, y, height(x, y)], -1).reshape(-1, 3).astype(np.float32)
    return Mesh(vertices, faces, None, smooth=True)


def scatter_stones(
    rng: np.random.Generator, large: float, small: float, height: Height, colours: meshes.Colours
) -> Mesh | None:
    """Stones of 3 to 25 cm and pebbles as one mesh, sunk a little into the ground.

    large, small: how many of either per 100 square metres.
    """
    big = scatter_disjoint(rng, large, STONE_SQUARE, 0.03, 0.25, 1.75)
    little = scatter_disjoint(rng, small, STONE_SQUARE, 0.010, 0.032, 2.5)
    stones = [meshes.make_stone(rng, 3, colours) for _ in range(14)]
    pebbles = [meshes.make_stone(rng, 1, colours) for _ in range(24)]
    found = []
    for places, kinds in ((big, stones), (little, pebbles)):
        if not len(places):
            continue
        z = height(places[:, 0], places[:, 1]) + 0.10 * places[:, 2]
        for (x, y, size), up in zip(places, z, strict=True):
            shape = kinds[rng.integers(len(kinds))]
            found.append(meshes.transform_mesh(shape, (x, y, up), size, rng.uniform(0, 2 * np.pi)))
    return meshes.merge_meshes(found) if found else None


def scatter_disjoint(
    rng: np.random.Generator, density: float, side: float, least: float, most: float, steep: float
) -> Float[Array, "n 3"]:
    """x, y and size of objects on a square of `side` about the origin, in loose groups and without overlap.

    density: per 100 square metres. Sizes lie between least and most; their density falls as size^-steep. An object for
    which 12 tries find no free place is left out.
    """
    count = round(density * side * side / 100)
    u = rng.uniform(size=count)
    power = 1 - steep
    sizes = np.sort((least**power + u * (most**power - least**power)) ** (1 / power))[::-1]
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


def smoothstep(low: float, high: float, x: Array) -> Array:
    """0 below low, 1 above high, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
