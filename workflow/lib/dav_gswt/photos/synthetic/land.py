"""What the families of synthetic ground share: a piece of land as it is rendered, and how things are strewn on it.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.photos.synthetic import meshes
from dav_gswt.photos.synthetic.meshes import Mesh

STREWN = 16.0  # metres: side of the square about the origin that has stones
Height = Callable[[Array, Array], Array]  # ground height at x, y


@dataclass(frozen=True)
class Light:
    """Sun and sky, in units of the exposure: irradiance across the beam and radiance; angles in degrees."""

    elevation: float  # of the sun
    azimuth: float  # from +x towards +y, where the sun stands
    sun: Float[Array, "3"]
    zenith: Float[Array, "3"]
    horizon: Float[Array, "3"]
    below: Float[Array, "3"]  # what comes from under the horizon: light that far ground throws back


@dataclass(frozen=True)
class Land:
    """A piece of land ready to be rendered.

    ground: coloured by `albedo`, which repeats after `period` metres. plants: kinds, each about 1 high. places: a row
    for every plant: which kind, x, y, z, size in metres, yaw in radians, and the ground's slope along x and along y
    that it follows (0 0: it stands upright).
    """

    ground: Mesh
    albedo: Float32[Array, "n n 3"]
    period: float
    stones: Mesh | None
    plants: list[Mesh]
    places: Float[Array, "m 8"]
    light: Light


def options(family: str, kind: type, bounds: dict[str, tuple[float, float]], given: dict):
    """Options of a family (`kind`, a dataclass of numbers) with some values given.

    Raises: InputError: an unknown name or a value out of bounds, by name.
    """
    for name, value in given.items():
        if name not in bounds:
            raise InputError(f"{family}: there is no option {name!r}; it has {', '.join(bounds)}")
        low, high = bounds[name]
        if not isinstance(value, int | float) or isinstance(value, bool) or not low <= value <= high:
            raise InputError(f"{family}: {name} is {value!r}; it must be a number from {low} to {high}")
    return kind(**{f.name: float(given.get(f.name, f.default)) for f in fields(kind)})


def levelled(height: Height, exemplar: float) -> Height:
    """The same ground, moved so that its mean over the exemplar is 0."""
    grid = np.linspace(-exemplar / 2, exemplar / 2, 256)
    level = height(*np.meshgrid(grid, grid)).mean()
    return lambda x, y: height(x, y) - level


def surface(height: Height) -> Mesh:
    """A grid that is fine about the origin and grows coarser towards the horizon. A texture colours it."""
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


def stones(
    rng: np.random.Generator, large: float, small: float, height: Height, colours: meshes.Colours
) -> Mesh | None:
    """Stones of 3 to 25 cm and pebbles, so many on 100 square metres, as one mesh, sunk a little into the ground."""
    big = scattered(rng, large, STREWN, 0.03, 0.25, 1.75)
    little = scattered(rng, small, STREWN, 0.010, 0.032, 2.5)
    shapes = [meshes.stone(rng, 3, colours) for _ in range(14)], [meshes.stone(rng, 1, colours) for _ in range(24)]
    found = []
    for places, kinds in ((big, shapes[0]), (little, shapes[1])):
        if not len(places):
            continue
        z = height(places[:, 0], places[:, 1]) + 0.10 * places[:, 2]
        for (x, y, size), up in zip(places, z, strict=True):
            shape = kinds[rng.integers(len(kinds))]
            found.append(meshes.placed(shape, (x, y, up), size, rng.uniform(0, 2 * np.pi)))
    return meshes.merged(found) if found else None


def scattered(
    rng: np.random.Generator, density: float, side: float, least: float, most: float, steep: float
) -> Float[Array, "n 3"]:
    """x, y and size of things on a square of `side` about the origin, in loose groups; small ones are more frequent.

    density: on 100 square metres. Sizes lie between least and most with a density that falls as size^-steep. Bigger
    things keep clear of each other by the sum of their sizes.
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


def sown(rng: np.random.Generator, density: Height, most: float, reach: float) -> Float[Array, "n 2"]:
    """Places x, y at random within `reach` of the origin, `density(x, y)` on a square metre; it never exceeds `most`.

    So many as the densest ground would have are thrown on the whole square, and each stays with the share of `most`
    that its ground has: a Poisson process but for its number.
    """
    thrown = rng.uniform(-reach, reach, (round(most * (2 * reach) ** 2), 2))
    stays = rng.uniform(0, most, len(thrown)) < density(*thrown.T)
    return thrown[stays & (np.hypot(*thrown.T) < reach)]


def smoothstep(low: float, high: float, x):
    """0 below low, 1 above high, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
