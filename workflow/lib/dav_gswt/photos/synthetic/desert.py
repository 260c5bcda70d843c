"""The desert family: sand with wind ripples, stones, pebbles, dry shrubs and grass, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, meshes, noise
from dav_gswt.photos.synthetic.land import FamilyOptions, Land, Light, option, scatter_disjoint, smoothstep

PERIOD = 16.0  # metres after which sand and ripples repeat; the undulation of the far ground does not
TEXELS = 2048  # a side of the period: 7.8 mm a texel
SAND = np.array([0.60, 0.437, 0.272])
SILT = np.array([0.67, 0.525, 0.36])
GRAVEL = np.array([0.39, 0.305, 0.225])
SUN = np.array([3.45, 3.05, 2.45])  # irradiance across the beam; like the sky's radiance in units of the exposure
ZENITH = np.array([0.17, 0.27, 0.47])
HORIZON = np.array([0.47, 0.53, 0.60])
DUNES = ((0.071, 0.043, 1.0, 1.0), (0.031, -0.083, 0.0, 1.0), (0.0, 0.09, 0.4, 0.7))


@dataclass(frozen=True)
class Options(FamilyOptions):
    """What a desert may vary in: default, least and greatest value."""

    undulation: float = option(0.10, 0.0, 0.4)  # metres, standard deviation of the rolling of the ground
    ripple_length: float = option(0.19, 0.10, 0.6)  # metres from crest to crest
    ripple_height: float = option(0.020, 0.0, 0.08)  # metres from trough to crest where ripples are strongest
    wind: float = option(25.0, -360.0, 360.0)  # degrees from +x, where the wind blows to
    stones: float = option(110.0, 0.0, 500.0)  # stones of 3 to 25 cm on 100 square metres
    pebbles: float = option(1100.0, 0.0, 4000.0)  # on 100 square metres
    shrubs: float = option(16.0, 0.0, 100.0)  # on 100 square metres
    tufts: float = option(34.0, 0.0, 200.0)  # of grass, on 100 square metres
    sun_elevation: float = option(40.0, 10.0, 85.0)  # degrees
    sun_azimuth: float = option(205.0, -360.0, 360.0)  # degrees from +x, where the sun stands


def make_land(o: Options, seed: int, exemplar: float) -> Land:
    """The desert of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x5A4D])
    sand, small = draw_sand(rng, o, TEXELS)
    large = o.undulation * noise.make_noise(rng, 512, PERIOD, longest=7.0, shortest=1.6, slope=1.6)
    plants = [meshes.make_shrub(rng) for _ in range(7)] + [meshes.make_tuft(rng) for _ in range(5)]
    shrubs = scatter_disjoint(rng, o.shrubs, 24.0, 0.20, 0.50, 1.6)
    tufts = scatter_disjoint(rng, o.tufts, 16.0, 0.10, 0.28, 1.2)
    mounds = np.concatenate([shrubs, tufts])

    height = land.level_ground(lambda x, y: _height(x, y, large, small, mounds, o), exemplar)
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
    stones = land.scatter_stones(rng, o.stones, o.pebbles, height, meshes.DESERT_STONES)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * SAND)
    return Land(land.make_ground_mesh(height), sand, PERIOD, stones, plants, places, light)


def draw_sand(rng, o: Options, n: int, gravel: float = 1.0) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The sand's colour and its small heights: ripples, fading out where gravel lies bare, and roughness.

    n: texels a side. gravel: how bare it lies, 0 to 1.
    """
    p = PERIOD
    phase, strength = noise.make_ripples(rng, n, p, o.ripple_length, np.radians(o.wind))
    bare = gravel * smoothstep(0.75, 1.5, noise.make_noise(rng, n, p, 3.5, 0.25, 1.0))
    calm = smoothstep(-0.4, 1.0, noise.make_noise(rng, n, p, 5.0, 1.5, 1.0))
    strength = strength * (1 - bare) * (0.35 + 0.65 * calm)
    profile = noise.map_rows(lambda phase, strength: noise.ripple_profile(phase) * strength, phase, strength)
    mottle = noise.make_noise(rng, n, p, 1.2, 0.08, 0.7)
    grain = noise.make_noise(rng, n, p, 0.06, 0.012, 0.5)
    speck = noise.make_noise(rng, n, p, 0.12, 0.03, 0.3)
    rough = noise.make_noise(rng, n, p, 0.30, 0.04, 1.0)
    heights = 0.5 * o.ripple_height * profile + (0.0016 + 0.002 * bare) * rough
    silt = smoothstep(0.2, 1.6, noise.make_noise(rng, n, p, 4.5, 0.5, 1.0))
    return noise.map_rows(_colour_sand, bare, silt, profile, mottle, grain, speck), heights


def _colour_sand(bare, silt, profile, mottle, grain, speck) -> Float32[Array, "*n 3"]:
    mix = 0.62 * bare * (0.75 + 0.25 * np.tanh(grain))
    tone = 0.10 * profile + 0.055 * mottle + (0.085 + 0.16 * bare) * grain + 0.05 * speck
    out = np.empty((*bare.shape, 3), np.float32)
    for c, redder in enumerate((0.9, 1.0, 1.15)):  # what is darker is redder
        colour = SAND[c] + 0.55 * silt * (SILT[c] - SAND[c])
        colour = colour * (1 - mix) + GRAVEL[c] * mix
        out[..., c] = np.clip(colour * np.exp(redder * tone), 0.02, 0.9)
    return out


def _height(x, y, large, small, mounds, o: Options):
    """Ground height before levelling: undulation, ripples near the middle, far dunes, and sand blown to plants."""
    z = land.fade_raster(large, PERIOD, x, y, 12.0, 30.0) + land.fade_raster(small, PERIOD, x, y, 7.0, 8.5)
    z = z + land.sum_hills(x, y, (14.0, 70.0), (o.undulation, 9.0), DUNES)
    return land.add_mounds(z, x, y, mounds, height=0.14, width=0.9, end=4.0)
