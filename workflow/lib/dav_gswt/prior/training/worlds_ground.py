"""The ground of a made-up world: a random relief, random colours, and both as discs out to the horizon."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import noise
from dav_gswt.photos.synthetic.land import step

Plane = Callable[[Array, Array], Array]  # a value at x, y

TEXELS, REPEATS = 256, 6  # of a noise raster a side, and longest wavelengths that it holds
SPACING, REACH, GROWTH, FAR = 0.055, 5.0, 1.12, 70.0  # metres; discs grow from REACH on, until FAR
WIDTH = 0.7  # standard deviation of a disc, in its spacings
BRIGHTNESS, TINT = 0.3, 0.06  # standard deviations of the logarithms by which a colour differs from its name's
EXEMPLAR = 6.0  # metres, as synthetic scenes have it
POOLS = 0.15  # share of worlds whose hollows are filled
PALE = 0.6  # most that a colour is mixed with grey
STEEPEST = 0.3  # metres: greatest standard deviation of a relief

# sRGB
GAMUT = {
    "loam": (0.36, 0.27, 0.19),
    "laterite": (0.60, 0.31, 0.19),
    "ochre": (0.68, 0.52, 0.31),
    "pale sand": (0.82, 0.75, 0.62),
    "grey sand": (0.62, 0.60, 0.55),
    "gravel": (0.50, 0.49, 0.47),
    "basalt": (0.23, 0.23, 0.24),
    "ash": (0.42, 0.40, 0.40),
    "asphalt": (0.30, 0.31, 0.32),
    "concrete": (0.66, 0.65, 0.62),
    "snow": (0.92, 0.94, 0.97),
    "salt": (0.88, 0.86, 0.82),
    "chalk": (0.85, 0.84, 0.77),
    "clay": (0.58, 0.45, 0.37),
    "peat": (0.20, 0.15, 0.12),
    "leaf litter": (0.47, 0.33, 0.20),
    "needles": (0.42, 0.28, 0.19),
    "moss": (0.35, 0.42, 0.17),
    "bright moss": (0.52, 0.58, 0.22),
    "lichen": (0.66, 0.69, 0.52),
    "orange lichen": (0.74, 0.50, 0.20),
    "turf": (0.30, 0.38, 0.18),
    "straw": (0.71, 0.63, 0.41),
    "slate": (0.35, 0.38, 0.43),
    "heath": (0.45, 0.30, 0.36),
    "mud": (0.34, 0.30, 0.25),
    "water": (0.22, 0.27, 0.29),
}


@dataclass(frozen=True)
class Terrain:
    """The bare ground: height in metres; linear albedo as a function of x, y, height and slope; by how much grains
    differ, as the deviation of a logarithm."""

    height: Plane
    albedo: Callable[[Array, Array, Array, Array], Array]
    grain: float


@dataclass(frozen=True)
class Discs:
    """Discs on a grid whose cells grow towards the horizon: where, their slopes, spacings and albedo."""

    means: Float[Array, "n 3"]
    east: Float[Array, "n"]
    north: Float[Array, "n"]
    sizes: Float[Array, "n 2"]
    albedo: Float[Array, "n 3"]


def linear(colour) -> Array:
    """Light of an encoded colour (a power of 2.2)."""
    return np.clip(np.asarray(colour, float), 0, 1) ** 2.2


def encoded(light) -> Array:
    """The inverse of `linear`; what is too bright is white."""
    return np.clip(light, 0, 1) ** (1 / 2.2)


def some_colour(rng: np.random.Generator, names: tuple[str, ...] | None = None) -> Float[Array, "3"]:
    """A linear colour near one of the gamut's."""
    names = names or tuple(GAMUT)
    base = linear(GAMUT[names[rng.integers(len(names))]])
    base = base + PALE * rng.uniform() * (base.mean() - base)
    return np.clip(base * np.exp(BRIGHTNESS * rng.normal() + TINT * rng.normal(size=3)), 0.01, 0.9)


def waves(rng: np.random.Generator, longest: float, shortest: float, slope: float, stretch: float = 1.0) -> Plane:
    """Noise of deviation 1 with wavelengths between the limits, turned at random and drawn out `stretch` times."""
    period = REPEATS * longest
    raster = noise.band(rng, TEXELS, period, longest, max(shortest, 2.5 * period / TEXELS), slope)
    turn, (du, dv) = rng.uniform(0, np.pi), rng.uniform(0, period, 2)
    c, s = np.cos(turn), np.sin(turn)
    return lambda x, y: noise.sample(raster, period, (c * x + s * y) / stretch + du, c * y - s * x + dv)


def terrain(rng: np.random.Generator) -> Terrain:
    """A relief of one to three forms and some roughness, perhaps with pools, under a mixture of colours."""
    forms = [_FORMS[i](rng) for i in rng.choice(len(_FORMS), rng.integers(1, 4), replace=False)]
    rough, share = _rough(rng), rng.uniform(0.2, 1.0)
    grid = np.meshgrid(*2 * [np.linspace(-EXEMPLAR / 2, EXEMPLAR / 2, 64)])
    share = min(share, STEEPEST / (sum(form(*grid) for form in forms).std() + 1e-6))

    def bare(x, y):
        return share * sum(form(x, y) for form in forms) + rough(x, y)

    here = bare(*grid)
    pool = np.quantile(here, rng.uniform(0.05, 0.35)) if rng.uniform() < POOLS else -np.inf
    up = 0.02 * rng.normal() - here.mean()
    colours = _colours(rng, here + up, pool + up)
    return Terrain(lambda x, y: np.maximum(bare(x, y), pool) + up, colours, rng.uniform(0.02, 0.2))


def discs(rng: np.random.Generator, land: Terrain) -> Discs:
    """The terrain's discs."""
    fine = np.arange(-REACH, REACH + 1e-9, SPACING)
    count = int(np.log(1 + (FAR - REACH) * (GROWTH - 1) / SPACING) / np.log(GROWTH))
    out = REACH + np.cumsum(SPACING * GROWTH ** np.arange(1, count + 1))
    axis = np.concatenate([-out[::-1], fine, out])
    cell = np.gradient(axis)
    x, y = np.meshgrid(axis, axis)
    z = land.height(x, y)
    north, east = np.gradient(z, axis, axis)
    sizes = np.stack([g.ravel() for g in np.meshgrid(cell, cell)], 1)
    x, y, z, east, north = (a.ravel() for a in (x, y, z, east, north))
    jitter = 0.25 * np.minimum(sizes, 4 * SPACING) * rng.uniform(-1, 1, sizes.shape)
    x, y = x + jitter[:, 0], y + jitter[:, 1]
    z = z + east * jitter[:, 0] + north * jitter[:, 1]
    grains = np.exp(land.grain * rng.normal(size=(len(x), 1)))
    albedo = np.clip(land.albedo(x, y, z, np.hypot(east, north)) * grains, 0.004, 0.92)
    return Discs(np.stack([x, y, z], 1), east, north, sizes, albedo)


def _rough(rng) -> Plane:
    wave, amplitude = waves(rng, rng.uniform(0.3, 1.2), 0.1, rng.uniform(0.5, 1.5)), 0.03 * rng.beta(1.2, 3)
    return lambda x, y: amplitude * wave(x, y)


def _rolling(rng) -> Plane:
    wave = waves(rng, rng.uniform(3, 14), 0.4, rng.uniform(1, 2), rng.uniform(1, 3))
    amplitude = rng.uniform(0.02, 0.3)
    return lambda x, y: amplitude * wave(x, y)


def _ridges(rng) -> Plane:
    wave, amplitude = waves(rng, rng.uniform(1.5, 6), 0.5, 1.5, rng.uniform(1, 4)), rng.uniform(0.05, 0.3)
    return lambda x, y: amplitude * (0.8 - np.sqrt(wave(x, y) ** 2 + 0.02))


def _leaning(rng) -> Plane:
    """Waves with a gentle and a steep side."""
    wave, amplitude = waves(rng, rng.uniform(1, 5), 0.8, 1.0, rng.uniform(1.5, 4)), rng.uniform(0.03, 0.2)
    turn, lean = rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 0.3)

    def height(x, y):
        shift = lean * wave(x, y)
        return amplitude * wave(x + shift * np.cos(turn), y + shift * np.sin(turn))

    return height


def _mounds(rng) -> Plane:
    wave, amplitude = waves(rng, rng.uniform(0.8, 3), 0.5, 1.0), rng.uniform(0.05, 0.3)
    least = rng.uniform(0, 1.2)
    return lambda x, y: amplitude * np.sqrt(np.maximum(wave(x, y) - least, 0))


def _terraces(rng) -> Plane:
    wave, rise = waves(rng, rng.uniform(4, 12), 0.6, 2.0), rng.uniform(0.08, 0.35)
    amplitude, edge = rng.uniform(1.0, 2.0), rng.uniform(0.1, 0.5)

    def height(x, y):
        whole, part = np.divmod(amplitude * wave(x, y), 1)
        return rise * (whole + step(1 - edge, 1.0, part))

    return height


def _gullies(rng) -> Plane:
    wave, depth = waves(rng, rng.uniform(2, 7), 0.5, 1.3, rng.uniform(1, 4)), rng.uniform(0.05, 0.35)
    width = rng.uniform(0.08, 0.4)
    return lambda x, y: -depth * np.exp(-((wave(x, y) / width) ** 2))


def _bank(rng) -> Plane:
    wave, rise, width = waves(rng, 4.0, 0.5, 1.5), rng.uniform(0.1, 0.5), rng.uniform(0.1, 1.2)
    turn, at, bend = rng.uniform(0, 2 * np.pi), rng.uniform(-2, 2), rng.uniform(0.05, 0.6)
    return lambda x, y: rise * np.tanh((x * np.cos(turn) + y * np.sin(turn) - at + bend * wave(x, y)) / width)


def _ruts(rng) -> Plane:
    wave, depth, width = waves(rng, 6.0, 0.6, 1.5), rng.uniform(0.02, 0.12), rng.uniform(0.08, 0.25)
    turn, at, apart = rng.uniform(0, 2 * np.pi), rng.uniform(-2, 2), rng.uniform(0.6, 1.8)

    def height(x, y):
        d = x * np.cos(turn) + y * np.sin(turn) - at + 0.1 * wave(x, y)
        return -depth * (np.exp(-((d / width) ** 2)) + np.exp(-(((d - apart) / width) ** 2)))

    return height


def _flat(rng) -> Plane:
    return lambda x, y: np.zeros_like(x)


_FORMS = (_rolling, _ridges, _leaning, _mounds, _terraces, _gullies, _bank, _ruts, _flat)


def _colours(rng, here: Array, pool: float):
    """Colours over one another, each where some driver is high; at last mottling, and what lies in pools."""
    base, wet = some_colour(rng), some_colour(rng, ("water", "mud", "slate", "salt"))
    overs = [(some_colour(rng), _driver(rng, here), rng.uniform(0.3, 1)) for _ in range(rng.integers(1, 5))]
    mottles = [(waves(rng, longest, longest / 8, 0.7), rng.uniform(0.03, 0.2)) for longest in (0.4, 2.0)]

    def albedo(x, y, z, slope):
        colour = np.broadcast_to(base, (*x.shape, 3)).copy()
        for over, driver, share in overs:
            colour += (share * driver(x, y, z, slope))[..., None] * (over - colour)
        shade = sum(strength * wave(x, y) for wave, strength in mottles)
        colour *= np.exp(shade)[..., None]
        return np.where((z <= pool + 1e-6)[..., None], wet, colour)

    return albedo


def _driver(rng, here: Array):
    """Where a colour lies: 0 to 1 by x, y, height and slope."""
    kind = rng.choice(["mottles", "patches", "spots", "stripes", "cracks", "low", "high", "steep"])
    wave, fine = waves(rng, rng.uniform(1, 8), 0.2, rng.uniform(0.5, 1.5), rng.uniform(1, 3)), waves(rng, 1.0, 0.1, 0.5)
    edge, soft = rng.uniform(-0.5, 1.0), rng.uniform(0.1, 1.0)
    turn, every = rng.uniform(0, np.pi), rng.uniform(0.3, 2.5)
    middle, spread, width = here.mean(), here.std() + 1e-3, rng.uniform(0.03, 0.12)
    drivers = {
        "mottles": lambda x, y, z, slope: step(-1.5, 1.5, wave(x, y) + 0.5 * fine(x, y)),
        "patches": lambda x, y, z, slope: step(edge, edge + 0.2 * soft, wave(x, y) + 0.2 * fine(x, y)),
        "spots": lambda x, y, z, slope: step(1.0, 1.3 + soft, fine(x, y) + 0.3 * wave(x, y)),
        "stripes": lambda x, y, z, slope: step(
            -soft, soft, np.sin(2 * np.pi * (x * np.cos(turn) + y * np.sin(turn)) / every + wave(x, y))
        ),
        "cracks": lambda x, y, z, slope: 1 - step(width / 2, width, np.abs(wave(x, y) + 0.15 * fine(x, y))),
        "low": lambda x, y, z, slope: step(0.0, 1.5, (middle - z) / spread + 0.4 * fine(x, y)),
        "high": lambda x, y, z, slope: step(0.0, 1.5, (z - middle) / spread + 0.4 * fine(x, y)),
        "steep": lambda x, y, z, slope: step(0.2, 0.6, slope + 0.1 * fine(x, y)),
    }
    return drivers[kind]
