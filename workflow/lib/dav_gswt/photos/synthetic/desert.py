"""The desert family: sand with wind ripples, stones, pebbles, dry shrubs and grass."""

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, meshes, noise, plants
from dav_gswt.photos.synthetic.land import PERIOD, FadingRaster, Hills, Land, Light
from dav_gswt.photos.synthetic.noise import smoothstep

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SAND = np.array([0.60, 0.437, 0.272])
SILT = np.array([0.67, 0.525, 0.36])
GRAVEL = np.array([0.39, 0.305, 0.225])
ROCK = np.array([[0.36, 0.28, 0.20], [0.22, 0.17, 0.13], [0.50, 0.40, 0.29], [0.42, 0.26, 0.16], [0.58, 0.50, 0.39]])
STONES: meshes.Colours = (ROCK, np.array([0.56, 0.42, 0.27]))
LIGHT = Light(40.0, 205.0, (3.45, 3.05, 2.45), (0.17, 0.27, 0.47), (0.47, 0.53, 0.60), 0.4 * SAND)
UNDULATION = 0.10  # metres, standard deviation
DUNES = Hills(
    (14.0, 70.0), (UNDULATION, 9.0), ((0.071, 0.043, 1.0, 1.0), (0.031, -0.083, 0.0, 1.0), (0.0, 0.09, 0.4, 0.7))
)


def make_land(seed: int, exemplar: float) -> Land:
    """The desert of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x5A4D])
    sand, small = draw_sand(rng, TEXELS, 0.19, 0.020, 25.0)
    large = UNDULATION * noise.make_noise(rng, 512, PERIOD, longest=7.0, shortest=1.6, slope=1.6)
    kinds = [plants.make_shrub(rng) for _ in range(7)] + [plants.make_dry_tuft(rng) for _ in range(5)]
    shrubs = land.scatter_disjoint(rng, 16.0, 24.0, 0.20, 0.50, 1.6)
    tufts = land.scatter_disjoint(rng, 34.0, 16.0, 0.10, 0.28, 1.2)
    mounds = np.concatenate([shrubs, tufts])
    relief = land.make_relief(FadingRaster(large, 12.0, 30.0), FadingRaster(small, 7.0, 8.5), DUNES)
    height = land.level_ground(
        lambda x, y: land.add_mounds(relief(x, y), x, y, mounds, height=0.14, width=0.9, end=4.0), exemplar
    )
    which = np.concatenate([rng.integers(0, 7, len(shrubs)), rng.integers(7, 12, len(tufts))])
    x, y, size = mounds.T
    places = land.stand_upright(rng, which, x, y, height(x, y), size)
    stones = land.scatter_stones(rng, 110.0, 1100.0, height, STONES)
    return Land(land.make_ground_mesh(height), sand, PERIOD, stones, kinds, places, LIGHT)


def draw_sand(
    rng, n: int, ripple_length: float, ripple_height: float, wind: float, gravel: float = 1.0
) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The sand's colour and its small heights: ripples, fading out where gravel lies bare, and roughness.

    n: texels a side. ripple_length: metres from crest to crest. ripple_height: from trough to crest where ripples are
    strongest. wind: degrees from +x, the direction the wind blows to. gravel: how bare it lies, 0 to 1.
    """
    p = PERIOD
    phase, strength = noise.make_ripples(rng, n, p, ripple_length, np.radians(wind))
    bare = gravel * smoothstep(0.75, 1.5, noise.make_noise(rng, n, p, 3.5, 0.25, 1.0))
    calm = smoothstep(-0.4, 1.0, noise.make_noise(rng, n, p, 5.0, 1.5, 1.0))
    profile = noise.ripple_profile(phase) * (strength * (1 - bare) * (0.35 + 0.65 * calm))
    mottle = noise.make_noise(rng, n, p, 1.2, 0.08, 0.7)
    grain = noise.make_noise(rng, n, p, 0.06, 0.012, 0.5)
    speck = noise.make_noise(rng, n, p, 0.12, 0.03, 0.3)
    rough = noise.make_noise(rng, n, p, 0.30, 0.04, 1.0)
    heights = 0.5 * ripple_height * profile + (0.0016 + 0.002 * bare) * rough
    silt = smoothstep(0.2, 1.6, noise.make_noise(rng, n, p, 4.5, 0.5, 1.0))
    mix = 0.62 * bare * (0.75 + 0.25 * np.tanh(grain))
    tone = 0.10 * profile + 0.055 * mottle + (0.085 + 0.16 * bare) * grain + 0.05 * speck
    colour = np.empty((n, n, 3), np.float32)
    for c, redder in enumerate((0.9, 1.0, 1.15)):  # what is darker is redder
        sand = SAND[c] + 0.55 * silt * (SILT[c] - SAND[c])
        colour[..., c] = np.clip((sand * (1 - mix) + GRAVEL[c] * mix) * np.exp(redder * tone), 0.02, 0.9)
    return colour, heights
