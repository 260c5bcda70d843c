"""The desert family: sand with wind ripples, stones, pebbles, dry shrubs and grass, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, meshes, noise
from dav_gswt.photos.synthetic.land import Land, Light, scattered, smoothstep

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


def options(**given) -> Options:
    """Options with some values given. Raises: InputError: an unknown name or a value out of bounds, by name."""
    return land.options("desert", Options, BOUNDS, given)


def grow(o: Options, seed: int, exemplar: float) -> Land:
    """The desert of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x5A4D])
    sand, small = _sand(rng, o)
    large = o.undulation * noise.band(rng, 512, PERIOD, longest=7.0, shortest=1.6, slope=1.6)
    plants = [meshes.shrub(rng) for _ in range(7)] + [meshes.tuft(rng) for _ in range(5)]
    shrubs = scattered(rng, o.shrubs, 24.0, 0.20, 0.50, 1.6)
    tufts = scattered(rng, o.tufts, 16.0, 0.10, 0.28, 1.2)
    mounds = np.concatenate([shrubs, tufts])

    height = land.levelled(lambda x, y: _height(x, y, large, small, mounds, o), exemplar)
    places = np.column_stack(
        [
            np.concatenate([rng.integers(0, 7, len(shrubs)), rng.integers(7, 12, len(tufts))]),
            mounds[:, :2],
            height(mounds[:, 0], mounds[:, 1]),
            mounds[:, 2],
            rng.uniform(0, 2 * np.pi, len(mounds)),
            np.zeros((len(mounds), 2)),
        ]
    )
    stones = land.stones(rng, o.stones, o.pebbles, height, meshes.DESERT_STONES)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * SAND)
    return Land(land.surface(height), sand, PERIOD, stones, plants, places, light)


def _sand(rng, o: Options) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The sand's colour and its small heights: ripples, fading out where gravel lies bare, and roughness."""
    n, p = TEXELS, PERIOD
    phase, strength = noise.ripples(rng, n, p, o.ripple_length, np.radians(o.wind))
    bare = smoothstep(0.75, 1.5, noise.band(rng, n, p, 3.5, 0.25, 1.0))
    calm = smoothstep(-0.4, 1.0, noise.band(rng, n, p, 5.0, 1.5, 1.0))
    strength = strength * (1 - bare) * (0.35 + 0.65 * calm)
    profile = noise.ripple_profile(phase) * strength
    mottle = noise.band(rng, n, p, 1.2, 0.08, 0.7)
    grain = noise.band(rng, n, p, 0.06, 0.012, 0.5)
    speck = noise.band(rng, n, p, 0.12, 0.03, 0.3)
    rough = noise.band(rng, n, p, 0.30, 0.04, 1.0)
    heights = 0.5 * o.ripple_height * profile + (0.0016 + 0.002 * bare) * rough
    silt = smoothstep(0.2, 1.6, noise.band(rng, n, p, 4.5, 0.5, 1.0))
    mix = (0.62 * bare * (0.75 + 0.25 * np.tanh(grain)))[..., None]
    colour = SAND + 0.55 * silt[..., None] * (SILT - SAND)
    colour = colour * (1 - mix) + GRAVEL * mix
    tone = 0.10 * profile + 0.055 * mottle + (0.085 + 0.16 * bare) * grain + 0.05 * speck
    shade = np.exp(tone)[..., None] ** np.array([0.9, 1.0, 1.15])  # what is darker is redder
    return np.clip(colour * shade, 0.02, 0.9).astype(np.float32), heights


def _height(x, y, large, small, mounds, o: Options):
    """Ground height before it is levelled: undulation, ripples near the middle, far dunes, and sand blown to plants."""
    r = np.hypot(x, y)
    z = noise.sample(large, PERIOD, x, y) * (1 - smoothstep(12.0, 30.0, r))
    z = z + noise.sample(small, PERIOD, x, y) * (1 - smoothstep(7.0, 8.5, r))
    far = smoothstep(14.0, 70.0, r) * o.undulation * 9
    z = z + far * (np.sin(0.071 * x + 0.043 * y + 1.0) + np.sin(0.031 * x - 0.083 * y) + 0.7 * np.sin(0.09 * y + 0.4))
    for px, py, size in mounds:
        near = np.abs(x - px) + np.abs(y - py) < 4 * size
        square = (x[near] - px) ** 2 + (y[near] - py) ** 2
        z[near] += 0.14 * size * np.exp(-square / (0.9 * size) ** 2)
    return z
