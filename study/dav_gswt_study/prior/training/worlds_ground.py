"""The ground of a procedural world: a random relief with random colours, as discs out to the horizon."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import noise
from dav_gswt.photos.synthetic.noise import smoothstep

Map = Callable[[Array, Array], Array]  # a value at x, y
Driver = Callable[[Array, Array, Array, Array], Array]  # a value at x, y, height and slope

TEXELS, REPEATS = 256, 6  # per side of a noise raster: texels, and longest wavelengths
SPACING, REACH, GROWTH, FAR = 0.055, 5.0, 1.12, 70.0  # metres; discs grow from REACH to FAR
WIDTH = 0.7  # scale of a disc, in its spacings
BRIGHTNESS, TINT = 0.3, 0.06  # standard deviations of log colour about a colour of the gamut
EXEMPLAR = 6.0  # metres, as of synthetic scenes
POOLS = 0.15  # share of worlds with pools
MOST_GREY = 0.6  # greatest share of grey in a colour
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
class Relief:
    """The bare ground: height in metres, linear albedo, and the standard deviation of log albedo between grains."""

    height: Map
    albedo: Driver
    grain: float


@dataclass(frozen=True)
class Discs:
    """Discs on a grid whose cells grow towards the horizon. east, north: slopes. sizes: spacings."""

    means: Float[Array, "n 3"]
    east: Float[Array, "n"]
    north: Float[Array, "n"]
    sizes: Float[Array, "n 2"]
    albedo: Float[Array, "n 3"]


def decode_colour(colour) -> Array:
    """Linear light of an encoded colour (gamma 2.2)."""
    return np.clip(np.asarray(colour, float), 0, 1) ** 2.2


def encode_light(light) -> Array:
    """The inverse of `decode_colour`, clipped at white."""
    return np.clip(light, 0, 1) ** (1 / 2.2)


def draw_colour(rng: np.random.Generator, names: tuple[str, ...] | None = None) -> Float[Array, "3"]:
    """A random linear colour near one of the gamut."""
    names = names or tuple(GAMUT)
    base = decode_colour(GAMUT[names[rng.integers(len(names))]])
    base = base + MOST_GREY * rng.uniform() * (base.mean() - base)
    return np.clip(base * np.exp(BRIGHTNESS * rng.normal() + TINT * rng.normal(size=3)), 0.01, 0.9)


def make_noise(rng: np.random.Generator, longest: float, shortest: float, slope: float, stretch: float = 1.0) -> Map:
    """Noise of standard deviation 1 with wavelengths between the limits, rotated at random, stretched along an axis."""
    period = REPEATS * longest
    raster = noise.make_noise(rng, TEXELS, period, longest, max(shortest, 2.5 * period / TEXELS), slope)
    turn, (du, dv) = rng.uniform(0, np.pi), rng.uniform(0, period, 2)
    c, s = np.cos(turn), np.sin(turn)
    return lambda x, y: noise.sample_raster(raster, period, (c * x + s * y) / stretch + du, c * y - s * x + dv)


def draw_relief(rng: np.random.Generator) -> Relief:
    """A random sum of one to three landforms and some roughness, perhaps with pools, and a mixture of colours."""
    forms = [LANDFORMS[i](rng) for i in rng.choice(len(LANDFORMS), rng.integers(1, 4), replace=False)]
    rough, share = _draw_roughness(rng), rng.uniform(0.2, 1.0)
    grid = np.meshgrid(*2 * [np.linspace(-EXEMPLAR / 2, EXEMPLAR / 2, 64)])

    def sum_forms(x: Array, y: Array) -> Array:
        return np.sum([form(x, y) for form in forms], axis=0)

    share = min(share, STEEPEST / (sum_forms(*grid).std() + 1e-6))

    def height(x: Array, y: Array) -> Array:
        return share * sum_forms(x, y) + rough(x, y)

    sampled = height(*grid)
    pool = np.quantile(sampled, rng.uniform(0.05, 0.35)) if rng.uniform() < POOLS else -np.inf
    offset = 0.02 * rng.normal() - sampled.mean()
    albedo = _draw_albedo(rng, sampled + offset, float(pool + offset))
    return Relief(lambda x, y: np.maximum(height(x, y), pool) + offset, albedo, rng.uniform(0.02, 0.2))


def make_discs(rng: np.random.Generator, relief: Relief) -> Discs:
    """The discs of a relief."""
    fine = np.arange(-REACH, REACH + 1e-9, SPACING)
    count = int(np.log(1 + (FAR - REACH) * (GROWTH - 1) / SPACING) / np.log(GROWTH))
    out = REACH + np.cumsum(SPACING * GROWTH ** np.arange(1, count + 1))
    axis = np.concatenate([-out[::-1], fine, out])
    cell = np.gradient(axis)
    x, y = np.meshgrid(axis, axis)
    z = relief.height(x, y)
    north, east = np.gradient(z, axis, axis)
    sizes = np.stack([g.ravel() for g in np.meshgrid(cell, cell)], 1)
    x, y, z, east, north = (a.ravel() for a in (x, y, z, east, north))
    jitter = 0.25 * np.minimum(sizes, 4 * SPACING) * rng.uniform(-1, 1, sizes.shape)
    x, y = x + jitter[:, 0], y + jitter[:, 1]
    z = z + east * jitter[:, 0] + north * jitter[:, 1]
    grains = np.exp(relief.grain * rng.normal(size=(len(x), 1)))
    albedo = np.clip(relief.albedo(x, y, z, np.hypot(east, north)) * grains, 0.004, 0.92)
    return Discs(np.stack([x, y, z], 1), east, north, sizes, albedo)


def _draw_roughness(rng: np.random.Generator) -> Map:
    wave, amplitude = make_noise(rng, rng.uniform(0.3, 1.2), 0.1, rng.uniform(0.5, 1.5)), 0.03 * rng.beta(1.2, 3)
    return lambda x, y: amplitude * wave(x, y)


def _rolling(rng: np.random.Generator) -> Map:
    wave = make_noise(rng, rng.uniform(3, 14), 0.4, rng.uniform(1, 2), rng.uniform(1, 3))
    amplitude = rng.uniform(0.02, 0.3)
    return lambda x, y: amplitude * wave(x, y)


def _ridges(rng: np.random.Generator) -> Map:
    wave, amplitude = make_noise(rng, rng.uniform(1.5, 6), 0.5, 1.5, rng.uniform(1, 4)), rng.uniform(0.05, 0.3)
    return lambda x, y: amplitude * (0.8 - np.sqrt(wave(x, y) ** 2 + 0.02))


def _leaning(rng: np.random.Generator) -> Map:
    """Waves with a gentle and a steep side, as dunes."""
    wave, amplitude = make_noise(rng, rng.uniform(1, 5), 0.8, 1.0, rng.uniform(1.5, 4)), rng.uniform(0.03, 0.2)
    turn, lean = rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 0.3)

    def height(x, y):
        shift = lean * wave(x, y)
        return amplitude * wave(x + shift * np.cos(turn), y + shift * np.sin(turn))

    return height


def _mounds(rng: np.random.Generator) -> Map:
    wave, amplitude = make_noise(rng, rng.uniform(0.8, 3), 0.5, 1.0), rng.uniform(0.05, 0.3)
    least = rng.uniform(0, 1.2)
    return lambda x, y: amplitude * np.sqrt(np.maximum(wave(x, y) - least, 0))


def _terraces(rng: np.random.Generator) -> Map:
    wave, rise = make_noise(rng, rng.uniform(4, 12), 0.6, 2.0), rng.uniform(0.08, 0.35)
    amplitude, edge = rng.uniform(1.0, 2.0), rng.uniform(0.1, 0.5)

    def height(x, y):
        whole, part = np.divmod(amplitude * wave(x, y), 1)
        return rise * (whole + smoothstep(1 - edge, 1.0, part))

    return height


def _gullies(rng: np.random.Generator) -> Map:
    wave, depth = make_noise(rng, rng.uniform(2, 7), 0.5, 1.3, rng.uniform(1, 4)), rng.uniform(0.05, 0.35)
    width = rng.uniform(0.08, 0.4)
    return lambda x, y: -depth * np.exp(-((wave(x, y) / width) ** 2))


def _bank(rng: np.random.Generator) -> Map:
    wave, rise, width = make_noise(rng, 4.0, 0.5, 1.5), rng.uniform(0.1, 0.5), rng.uniform(0.1, 1.2)
    turn, at, bend = rng.uniform(0, 2 * np.pi), rng.uniform(-2, 2), rng.uniform(0.05, 0.6)
    return lambda x, y: rise * np.tanh((x * np.cos(turn) + y * np.sin(turn) - at + bend * wave(x, y)) / width)


def _ruts(rng: np.random.Generator) -> Map:
    wave, depth, width = make_noise(rng, 6.0, 0.6, 1.5), rng.uniform(0.02, 0.12), rng.uniform(0.08, 0.25)
    turn, at, apart = rng.uniform(0, 2 * np.pi), rng.uniform(-2, 2), rng.uniform(0.6, 1.8)

    def height(x, y):
        d = x * np.cos(turn) + y * np.sin(turn) - at + 0.1 * wave(x, y)
        return -depth * (np.exp(-((d / width) ** 2)) + np.exp(-(((d - apart) / width) ** 2)))

    return height


def _flat(rng: np.random.Generator) -> Map:
    return lambda x, y: np.zeros_like(x)


LANDFORMS: tuple[Callable[[np.random.Generator], Map], ...] = (
    _rolling,
    _ridges,
    _leaning,
    _mounds,
    _terraces,
    _gullies,
    _bank,
    _ruts,
    _flat,
)


def _draw_albedo(rng: np.random.Generator, heights: Array, pool: float) -> Driver:
    """Layers of colours, each where some driver is high, then mottling, and the colour of pools."""
    base, wet = draw_colour(rng), draw_colour(rng, ("water", "mud", "slate", "salt"))
    layers = [(draw_colour(rng), _draw_driver(rng, heights), rng.uniform(0.3, 1)) for _ in range(rng.integers(1, 5))]
    mottles = [(make_noise(rng, longest, longest / 8, 0.7), rng.uniform(0.03, 0.2)) for longest in (0.4, 2.0)]

    def albedo(x, y, z, slope):
        colour = np.broadcast_to(base, (*x.shape, 3)).copy()
        for over, driver, share in layers:
            colour += (share * driver(x, y, z, slope))[..., None] * (over - colour)
        shade = np.sum([strength * wave(x, y) for wave, strength in mottles], axis=0)
        colour *= np.exp(shade)[..., None]
        return np.where((z <= pool + 1e-6)[..., None], wet, colour)

    return albedo


def _draw_driver(rng: np.random.Generator, heights: Array) -> Driver:
    """The share of a colour, 0 to 1."""
    kind = rng.choice(["mottles", "patches", "spots", "stripes", "cracks", "low", "high", "steep"])
    wave, fine = (
        make_noise(rng, rng.uniform(1, 8), 0.2, rng.uniform(0.5, 1.5), rng.uniform(1, 3)),
        make_noise(rng, 1.0, 0.1, 0.5),
    )
    edge, soft = rng.uniform(-0.5, 1.0), rng.uniform(0.1, 1.0)
    turn, every = rng.uniform(0, np.pi), rng.uniform(0.3, 2.5)
    middle, spread, width = heights.mean(), heights.std() + 1e-3, rng.uniform(0.03, 0.12)
    drivers = {
        "mottles": lambda x, y, z, slope: smoothstep(-1.5, 1.5, wave(x, y) + 0.5 * fine(x, y)),
        "patches": lambda x, y, z, slope: smoothstep(edge, edge + 0.2 * soft, wave(x, y) + 0.2 * fine(x, y)),
        "spots": lambda x, y, z, slope: smoothstep(1.0, 1.3 + soft, fine(x, y) + 0.3 * wave(x, y)),
        "stripes": lambda x, y, z, slope: smoothstep(
            -soft, soft, np.sin(2 * np.pi * (x * np.cos(turn) + y * np.sin(turn)) / every + wave(x, y))
        ),
        "cracks": lambda x, y, z, slope: 1 - smoothstep(width / 2, width, np.abs(wave(x, y) + 0.15 * fine(x, y))),
        "low": lambda x, y, z, slope: smoothstep(0.0, 1.5, (middle - z) / spread + 0.4 * fine(x, y)),
        "high": lambda x, y, z, slope: smoothstep(0.0, 1.5, (z - middle) / spread + 0.4 * fine(x, y)),
        "steep": lambda x, y, z, slope: smoothstep(0.2, 0.6, slope + 0.1 * fine(x, y)),
    }
    return drivers[kind]
