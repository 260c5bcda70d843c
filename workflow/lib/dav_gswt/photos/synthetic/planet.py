"""The planet family: a barren, rocky plain with craters, boulders and drifts of dust under a low sun, from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, noise, rocks
from dav_gswt.photos.synthetic.land import FamilyOptions, Height, Land, Light, option, scatter_points, smoothstep
from dav_gswt.photos.synthetic.meshes import Colours

PERIOD = 20.0  # metres after which the ground's colours and roughness repeat; craters and rocks do not
TEXELS = 2560  # a side of the period: 7.8 mm a texel
REGOLITH = np.array([0.30, 0.152, 0.084])
DUST = np.array([0.41, 0.232, 0.13])
BASALT = np.array([0.165, 0.098, 0.068])  # dark grit where no dust lies
ROCKS: Colours = (
    np.array([[0.135, 0.098, 0.08], [0.19, 0.12, 0.085], [0.27, 0.145, 0.088], [0.10, 0.082, 0.075]]),
    DUST,
)
SUN = np.array([7.3, 6.0, 4.6])  # irradiance across the beam; like the sky's radiance in units of the exposure
ZENITH = np.array([0.20, 0.125, 0.075])
HORIZON = np.array([0.56, 0.38, 0.235])
HILLS = ((0.047, 0.031, 1.0, 1.0), (0.029, -0.053, 0.0, 1.0), (0.0, 0.11, 0.4, 0.6))
# rocks: metres across least and most, metres from the origin to which they lie, kinds, subdivisions of their meshes
SORTS = ((0.012, 0.035, 8.5, 10, 1), (0.035, 0.10, 15.0, 12, 2), (0.10, 0.30, 38.0, 10, 3), (0.30, 0.60, 80.0, 8, 4))


@dataclass(frozen=True)
class Options(FamilyOptions):
    """What a planet may vary in: default, least and greatest value."""

    undulation: float = option(0.16, 0.0, 0.5)  # metres, standard deviation of the rolling of the ground
    craters: float = option(34.0, 0.0, 150.0)  # of 0.25 m and more, on 100 square metres
    ripple_length: float = option(0.34, 0.15, 1.0)  # metres from crest to crest
    ripple_height: float = option(0.026, 0.0, 0.08)  # metres from trough to crest where dust lies deepest
    wind: float = option(140.0, -360.0, 360.0)  # degrees from +x, where the wind blows to
    dust: float = option(0.42, 0.0, 1.0)  # share of the ground that dust covers
    boulders: float = option(9.0, 0.0, 40.0)  # rocks of 30 to 60 cm on 100 square metres
    rocks: float = option(95.0, 0.0, 400.0)  # rocks of 10 to 30 cm on 100 square metres
    stones: float = option(750.0, 0.0, 2000.0)  # rocks of 3.5 to 10 cm on 100 square metres
    pebbles: float = option(1800.0, 0.0, 6000.0)  # on 100 square metres
    sun_elevation: float = option(21.0, 10.0, 85.0)  # degrees
    sun_azimuth: float = option(155.0, -360.0, 360.0)  # degrees from +x, where the sun stands


def make_land(o: Options, seed: int, exemplar: float) -> Land:
    """The planet of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x9147])
    albedo, small = _draw_ground(rng, o)
    large = o.undulation * noise.make_noise(rng, 512, PERIOD, longest=9.0, shortest=1.8, slope=1.7)
    craters = _draw_craters(rng, o)
    outlines = rocks.draw_outlines(rng, len(craters))
    height = land.level_ground(lambda x, y: _height(x, y, large, small, (craters, outlines), o), exemplar)
    plants, places = [], []
    for count, (least, most, reach, kinds, fine) in zip((o.pebbles, o.stones, o.rocks, o.boulders), SORTS, strict=True):
        lying = _scatter_rocks(rng, count, reach, craters)
        which = len(plants) + rng.integers(0, kinds, len(lying))
        plants += [rocks.make_rock(rng, fine, ROCKS) for _ in range(kinds)]
        places.append(_place_rocks(rng, which, lying, rocks.draw_sizes(rng, len(lying), least, most, 2.2), height))
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.3 * REGOLITH)
    return Land(land.make_ground_mesh(height), albedo, PERIOD, None, plants, np.concatenate(places), light)


def _draw_craters(rng, o: Options) -> Float[Array, "n 4"]:
    """Small craters near the origin, larger ones further out, as far as each can be seen."""
    near = rocks.draw_craters(rng, round(o.craters * 4.0), 20.0, 0.25, 2.4)
    middle = rocks.draw_craters(rng, round(o.craters * 3.0), 90.0, 2.0, 9.0)
    far = rocks.draw_craters(rng, round(o.craters * 1.0), 500.0, 16.0, 60.0)
    clear = [found[np.hypot(*found[:, :2].T) > 4.0 + 1.2 * found[:, 2]] for found in (middle, far)]
    return np.concatenate([near, *clear])


def _draw_ground(rng, o: Options) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The ground's colour and its small heights: clods, grit, and dust in ripples where it lies deep."""
    n, p = TEXELS, PERIOD
    spread = noise.make_noise(rng, n, p, 4.0, 0.4, 1.1)
    low, high = np.quantile(spread, [max(0.0, 0.82 - o.dust), min(1.0, 1.18 - o.dust)])
    dust = smoothstep(low, high, spread)
    grit = smoothstep(0.5, 1.6, noise.make_noise(rng, n, p, 2.2, 0.2, 0.9)) * (1 - dust)
    phase, strength = noise.make_ripples(rng, n, p, o.ripple_length, np.radians(o.wind))
    profile = noise.ripple_profile(phase) * strength * dust
    clods = noise.make_noise(rng, n, p, 0.6, 0.04, 1.0)
    grain = noise.make_noise(rng, n, p, 0.07, 0.012, 0.5)
    mottle = noise.make_noise(rng, n, p, 1.4, 0.08, 0.7)
    heights = 0.5 * o.ripple_height * profile + (0.0050 - 0.0035 * dust) * clods
    colour = REGOLITH + dust[..., None] * (DUST - REGOLITH)
    share = np.clip(0.75 * grit * (0.8 + 0.35 * grain), 0, 1)[..., None]
    colour = colour * (1 - share) + BASALT * share
    tone = 0.10 * profile + 0.05 * mottle + (0.17 - 0.12 * dust) * grain
    return np.clip(colour * np.exp(tone)[..., None], 0.02, 0.9).astype(np.float32), heights


def _height(x, y, large, small, craters: tuple[Array, Array], o: Options):
    """Ground height before levelling: rolling, roughness near the middle, craters, and far ridges."""
    z = land.fade_raster(large, PERIOD, x, y, 16.0, 45.0) + land.fade_raster(small, PERIOD, x, y, 8.0, 11.0)
    z = z + rocks.crater_relief(x, y, *craters)
    z = z + land.sum_hills(x, y, (20.0, 160.0), (o.undulation, 12.0), HILLS)
    return z + smoothstep(150.0, 400.0, np.hypot(x, y)) * _ridges(x, y)


def _ridges(x, y):
    """Far mountains: blunt crests where waves cross 0, the more gullied the shorter the waves."""
    waves = (0.009, 0.004, 1.3, 15.0), (-0.005, 0.013, 0.4, 9.0), (0.023, -0.019, 2.0, 4.5), (0.041, 0.052, 0.1, 2.2)
    total = sum(high * (1 - 2 * np.sqrt(np.sin(kx * x + ky * y + at) ** 2 + 0.15)) for kx, ky, at, high in waves)
    return 1.5 * np.maximum(total + 9.0, 0)


def _scatter_rocks(rng, count: float, reach: float, craters) -> Float[Array, "n 2"]:
    """Random places of rocks of a sort, in loose fields that thin out towards `reach`; a fifth lie about crater rims.

    count: per 100 square metres near the origin.
    """
    fields = noise.make_noise(rng, 256, PERIOD, 6.0, 0.8, 1.0)
    share = 0.008 * count * np.clip(np.exp(0.7 * fields - 0.25), 0, 4)

    def density(x, y):
        return noise.sample_raster(share, PERIOD, x, y) * (1 - smoothstep(0.5 * reach, reach, np.hypot(x, y)))

    lying = scatter_points(rng, density, share.max(), reach)
    weight = craters[:, 3] * craters[:, 2] ** 1.5 * (np.hypot(*craters[:, :2].T) < reach)
    if not weight.sum():
        return lying
    rims = craters[rng.choice(len(craters), round(0.25 * len(lying)), p=weight / weight.sum())]
    away = 0.5 * rims[:, 2] * np.abs(rng.normal(1.25, 0.35, len(rims)))
    turn = rng.uniform(0, 2 * np.pi, len(rims))
    return np.concatenate([lying, rims[:, :2] + away[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])])


def _place_rocks(rng, which, lying, size, height: Height) -> Float[Array, "n 8"]:
    """Rows of Land.places for rocks, from barely to more than half buried."""
    x, y = lying.T
    z = height(x, y) + size * rng.uniform(-0.16, 0.20, len(x))
    return np.column_stack([which, x, y, z, size, rng.uniform(0, 2 * np.pi, len(x)), np.zeros((len(x), 2))])
