"""The desert family: sand with wind ripples, stones, pebbles, dry shrubs and grass, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.photos import noise, things
from dav_gswt.photos.things import Mesh

PERIOD = 16.0  # metres after which sand and ripples repeat; the undulation of the far ground does not
TEXELS = 2048  # a side of the period: 7.8 mm a texel
SAND = np.array([0.60, 0.437, 0.272])
SILT = np.array([0.67, 0.525, 0.36])
GRAVEL = np.array([0.39, 0.305, 0.225])
SUN = np.array([3.45, 3.05, 2.45])  # irradiance across the beam, in units of the exposure; so is the sky's radiance:
ZENITH = np.array([0.17, 0.27, 0.47])
HORIZON = np.array([0.47, 0.53, 0.60])


@dataclass(frozen=True)
class Options:
    """What a desert may vary in; BOUNDS holds the least and the greatest value of each."""

    undulation: float = 0.10  # metres, standard deviation of the rolling of the ground
    ripple_length: float = 0.19  # metres from crest to crest
    ripple_height: float = 0.020  # metres from trough to crest where ripples are strongest
    wind: float = 25.0  # degrees from +x, where the wind blows to
    stones: float = 110.0  # stones of 3 to 25 cm on 100 square metres
    pebbles: float = 1100.0  # on 100 square metres
    shrubs: float = 16.0  # on 100 square metres
    tufts: float = 34.0  # of grass, on 100 square metres
    sun_elevation: float = 40.0  # degrees
    sun_azimuth: float = 205.0  # degrees from +x, where the sun stands


BOUNDS = {
    "undulation": (0.0, 0.4),
    "ripple_length": (0.10, 0.6),
    "ripple_height": (0.0, 0.08),
    "wind": (-360.0, 360.0),
    "stones": (0.0, 500.0),
    "pebbles": (0.0, 4000.0),
    "shrubs": (0.0, 100.0),
    "tufts": (0.0, 200.0),
    "sun_elevation": (10.0, 85.0),
    "sun_azimuth": (-360.0, 360.0),
}


@dataclass(frozen=True)
class Desert:
    """A desert ready to be rendered. shrubs, tufts: (which mesh, x, y, z, size in metres, yaw in radians) a row."""

    ground: Mesh
    sand: Float32[Array, "n n 3"]
    stones: Mesh | None
    plants: list[Mesh]
    plant_places: Float[Array, "m 6"]


def options(**given) -> Options:
    """Options with some values given. Raises: InputError: an unknown name or a value out of bounds, by name."""
    for name, value in given.items():
        if name not in BOUNDS:
            raise InputError(f"desert: there is no option {name!r}; it has {', '.join(BOUNDS)}")
        low, high = BOUNDS[name]
        if not isinstance(value, int | float) or isinstance(value, bool) or not low <= value <= high:
            raise InputError(f"desert: {name} is {value!r}; it must be a number from {low} to {high}")
    return Options(**{f.name: float(given.get(f.name, f.default)) for f in fields(Options)})


def grow(o: Options, seed: int, exemplar: float) -> Desert:
    """The desert of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x5A4D])
    sand, small = _sand(rng, o)
    large = o.undulation * noise.band(rng, 512, PERIOD, longest=7.0, shortest=1.6, slope=1.6)
    plants = [things.shrub(rng) for _ in range(7)] + [things.tuft(rng) for _ in range(5)]
    shrubs = _scattered(rng, o.shrubs, 24.0, 0.20, 0.50, 1.6)
    tufts = _scattered(rng, o.tufts, 16.0, 0.10, 0.28, 1.2)
    mounds = np.concatenate([shrubs, tufts])

    def height(x, y):
        return _height(x, y, large, small, mounds, o)

    grid = np.linspace(-exemplar / 2, exemplar / 2, 256)
    level = height(*np.meshgrid(grid, grid)).mean()
    places = np.column_stack(
        [
            np.concatenate([rng.integers(0, 7, len(shrubs)), rng.integers(7, 12, len(tufts))]),
            mounds[:, :2],
            height(mounds[:, 0], mounds[:, 1]) - level,
            mounds[:, 2],
            rng.uniform(0, 2 * np.pi, len(mounds)),
        ]
    )
    stones = _stones(rng, o, lambda x, y: height(x, y) - level)
    return Desert(_ground(lambda x, y: height(x, y) - level), sand, stones, plants, places)


def _sand(rng, o: Options) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The sand's colour and its small heights: ripples, fading out where gravel lies bare, and roughness."""
    n, p = TEXELS, PERIOD
    phase, strength = noise.ripples(rng, n, p, o.ripple_length, np.radians(o.wind))
    bare = _step(0.75, 1.5, noise.band(rng, n, p, 3.5, 0.25, 1.0))
    calm = _step(-0.4, 1.0, noise.band(rng, n, p, 5.0, 1.5, 1.0))
    strength = strength * (1 - bare) * (0.35 + 0.65 * calm)
    profile = noise.ripple_profile(phase) * strength
    mottle = noise.band(rng, n, p, 1.2, 0.08, 0.7)
    grain = noise.band(rng, n, p, 0.06, 0.012, 0.5)
    speck = noise.band(rng, n, p, 0.12, 0.03, 0.3)
    rough = noise.band(rng, n, p, 0.30, 0.04, 1.0)
    heights = 0.5 * o.ripple_height * profile + (0.0016 + 0.002 * bare) * rough
    silt = _step(0.2, 1.6, noise.band(rng, n, p, 4.5, 0.5, 1.0))
    mix = (0.62 * bare * (0.75 + 0.25 * np.tanh(grain)))[..., None]
    colour = SAND + 0.55 * silt[..., None] * (SILT - SAND)
    colour = colour * (1 - mix) + GRAVEL * mix
    tone = 0.10 * profile + 0.055 * mottle + (0.085 + 0.16 * bare) * grain + 0.05 * speck
    shade = np.exp(tone)[..., None] ** np.array([0.9, 1.0, 1.15])  # what is darker is redder
    return np.clip(colour * shade, 0.02, 0.9).astype(np.float32), heights


def _height(x, y, large, small, mounds, o: Options):
    """Ground height before it is levelled: undulation, ripples near the middle, far dunes, and sand blown to plants."""
    r = np.hypot(x, y)
    z = noise.sample(large, PERIOD, x, y) * (1 - _step(12.0, 30.0, r))
    z = z + noise.sample(small, PERIOD, x, y) * (1 - _step(7.0, 8.5, r))
    far = _step(14.0, 70.0, r) * o.undulation * 9
    z = z + far * (np.sin(0.071 * x + 0.043 * y + 1.0) + np.sin(0.031 * x - 0.083 * y) + 0.7 * np.sin(0.09 * y + 0.4))
    for px, py, size in mounds:
        near = np.abs(x - px) + np.abs(y - py) < 4 * size
        square = (x[near] - px) ** 2 + (y[near] - py) ** 2
        z[near] += 0.14 * size * np.exp(-square / (0.9 * size) ** 2)
    return z


def _ground(height) -> Mesh:
    """A grid that is fine about the origin and grows coarser towards the horizon. The sand colours it."""
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


def _stones(rng, o: Options, height) -> Mesh | None:
    """Stones of all sizes as one mesh, sunk a little into the sand."""
    big = _scattered(rng, o.stones, 16.0, 0.03, 0.25, 1.75)
    small = _scattered(rng, o.pebbles, 16.0, 0.010, 0.032, 2.5)
    shapes = [things.stone(rng, 3) for _ in range(14)], [things.stone(rng, 1) for _ in range(24)]
    found = []
    for places, kinds in ((big, shapes[0]), (small, shapes[1])):
        if not len(places):
            continue
        z = height(places[:, 0], places[:, 1]) + 0.10 * places[:, 2]
        for (x, y, size), up in zip(places, z, strict=True):
            shape = kinds[rng.integers(len(kinds))]
            found.append(things.placed(shape, (x, y, up), size, rng.uniform(0, 2 * np.pi)))
    return things.merged(found) if found else None


def _scattered(rng, density: float, side: float, least: float, most: float, steep: float) -> Float[Array, "n 3"]:
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


def _step(low: float, high: float, x):
    """0 below low, 1 above high, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
