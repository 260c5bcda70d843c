"""The planet family: a barren, rocky plain with craters, boulders and drifts of dust under a low sun."""

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, meshes, noise
from dav_gswt.photos.synthetic.land import FadingRaster, Hills, Land, Light
from dav_gswt.photos.synthetic.noise import smoothstep

PERIOD = 20.0  # metres after which the ground's colours and roughness repeat; craters and rocks do not
TEXELS = 2560  # a side of the period: 7.8 mm a texel
REGOLITH = np.array([0.30, 0.152, 0.084])
DUST = np.array([0.41, 0.232, 0.13])
BASALT = np.array([0.165, 0.098, 0.068])  # dark grit where no dust lies
ROCK = np.array([[0.135, 0.098, 0.08], [0.19, 0.12, 0.085], [0.27, 0.145, 0.088], [0.10, 0.082, 0.075]])
ROCKS: meshes.Colours = (ROCK, DUST)
LIGHT = Light(21.0, 155.0, (7.3, 6.0, 4.6), (0.20, 0.125, 0.075), (0.56, 0.38, 0.235), 0.3 * REGOLITH)
UNDULATION = 0.16  # metres, standard deviation
HILLS = Hills(
    (20.0, 160.0), (UNDULATION, 12.0), ((0.047, 0.031, 1.0, 1.0), (0.029, -0.053, 0.0, 1.0), (0.0, 0.11, 0.4, 0.6))
)
# craters: how many, on a square of which side, least and greatest diameter, metres
CRATERS = ((136, 20.0, 0.25, 2.4), (102, 90.0, 2.0, 9.0), (34, 500.0, 16.0, 60.0))
DEPTH, RIM = 0.20, 0.06  # depth of a fresh crater and height of its rim above the plain, in diameters
# rocks: how many on 100 square metres, metres across least and most, metres from the origin to which they lie, kinds,
# subdivisions of their meshes
SORTS = (
    (1800.0, 0.012, 0.035, 8.5, 10, 1),
    (750.0, 0.035, 0.10, 15.0, 12, 2),
    (95.0, 0.10, 0.30, 38.0, 10, 3),
    (9.0, 0.30, 0.60, 80.0, 8, 4),
)


def make_land(seed: int, exemplar: float) -> Land:
    """The planet of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x9147])
    albedo, small = _draw_ground(rng)
    large = FadingRaster(UNDULATION * noise.make_noise(rng, 512, PERIOD, 9.0, 1.8, 1.7), 16.0, 45.0)
    small = FadingRaster(small, 8.0, 11.0)
    craters = _draw_craters(rng)
    amplitudes = np.abs(rng.normal(0, [0.06, 0.045, 0.02], (len(craters), 3)))
    outlines = np.column_stack([amplitudes, rng.uniform(0, 2 * np.pi, (len(craters), 3))])

    def relief(x, y):
        z = large.height(x, y, PERIOD) + small.height(x, y, PERIOD) + crater_relief(x, y, craters, outlines)
        return z + HILLS.height(x, y) + smoothstep(150.0, 400.0, np.hypot(x, y)) * _ridges(x, y)

    height = land.level_ground(relief, exemplar)
    kinds, places = [], []
    for count, least, most, reach, different, fine in SORTS:
        lying = _scatter_rocks(rng, count, reach, craters)
        which = len(kinds) + rng.integers(0, different, len(lying))
        kinds += [meshes.make_rock(rng, fine, ROCKS) for _ in range(different)]
        size, (x, y) = meshes.draw_sizes(rng, len(lying), least, most, 2.2), lying.T
        z = height(x, y) + size * rng.uniform(-0.16, 0.20, len(x))  # from barely to more than half buried
        places.append(land.stand_upright(rng, which, x, y, z, size))
    return Land(land.make_ground_mesh(height), albedo, PERIOD, None, kinds, np.concatenate(places), LIGHT)


def _draw_craters(rng) -> Float[Array, "n 4"]:
    """Random craters: x, y, diameter, freshness from 0.15 to 1; small ones near the origin, larger ones further out.

    The number of craters above a diameter d falls as d^-2, as on ground that is saturated with craters.
    """
    found = []
    for count, side, least, most in CRATERS:
        u = rng.uniform(size=count)
        diameter = (least**-2.0 + u * (most**-2.0 - least**-2.0)) ** -0.5
        fresh = 0.15 + 0.85 * rng.uniform(size=count) ** 1.4
        lying = rng.uniform(-side / 2, side / 2, (count, 2))
        craters = np.column_stack([lying, np.sort(diameter)[::-1], fresh])
        found.append(craters[np.hypot(*lying.T) > 4.0 + 1.2 * craters[:, 2]] if found else craters)
    return np.concatenate(found)


def crater_relief(x, y, craters: Float[Array, "n 4"], outlines: Float[Array, "n 6"]) -> Array:
    """The height that craters add at places: a bowl, a rim, and the ejecta around it.

    With r the distance in radii and d the diameter, a fresh crater adds -DEPTH d (1 - r^2.4) + RIM d r^2.4 inside and
    RIM d r^-3.4 outside, which ends at 3.5 radii; an old crater is lower and softer. The radius varies with the azimuth
    by `outlines`: amplitudes of three waves, and their phases.
    """
    total = np.zeros(np.shape(x))
    for (cx, cy, d, fresh), bend in zip(craters, outlines, strict=True):
        near = np.abs(x - cx) + np.abs(y - cy) < 3.6 * d / 2 * 1.42
        dx, dy = x[near] - cx, y[near] - cy
        turn = np.arctan2(dy, dx)
        waves = bend[0] * np.cos(2 * turn + bend[3]) + bend[1] * np.cos(3 * turn + bend[4])
        r = np.hypot(dx, dy) / (d / 2) / (1 + waves + bend[2] * np.cos(7 * turn + bend[5]))
        soft = 0.05 + 0.25 * (1 - fresh)
        inside = r**2.4 * (DEPTH + RIM) - DEPTH
        outside = RIM * np.maximum(r, 0.3) ** -3.4 * np.clip((3.5 - r) / 2.0, 0, 1)
        share = 0.5 + 0.5 * np.tanh((r - 1) / soft)
        total[near] += fresh * d * (np.minimum(inside, RIM) * (1 - share) + np.minimum(outside, RIM) * share)
    return total


def _draw_ground(rng) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The ground's colour and its small heights: clods, grit, and dust in ripples where it lies deep."""
    n, p = TEXELS, PERIOD
    spread = noise.make_noise(rng, n, p, 4.0, 0.4, 1.1)
    low, high = np.quantile(spread, [0.82 - 0.42, 1.18 - 0.42])
    dust = smoothstep(low, high, spread)  # on 42 % of the ground
    grit = smoothstep(0.5, 1.6, noise.make_noise(rng, n, p, 2.2, 0.2, 0.9)) * (1 - dust)
    phase, strength = noise.make_ripples(rng, n, p, 0.34, np.radians(140.0))
    profile = noise.ripple_profile(phase) * strength * dust
    clods = noise.make_noise(rng, n, p, 0.6, 0.04, 1.0)
    grain = noise.make_noise(rng, n, p, 0.07, 0.012, 0.5)
    mottle = noise.make_noise(rng, n, p, 1.4, 0.08, 0.7)
    heights = 0.5 * 0.026 * profile + (0.0050 - 0.0035 * dust) * clods
    colour = REGOLITH + dust[..., None] * (DUST - REGOLITH)
    share = np.clip(0.75 * grit * (0.8 + 0.35 * grain), 0, 1)[..., None]
    colour = colour * (1 - share) + BASALT * share
    tone = 0.10 * profile + 0.05 * mottle + (0.17 - 0.12 * dust) * grain
    return np.clip(colour * np.exp(tone)[..., None], 0.02, 0.9).astype(np.float32), heights


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
    density = land.fade_out(lambda x, y: noise.sample_raster(share, PERIOD, x, y), 0.5 * reach, reach)
    lying = land.scatter_points(rng, density, share.max(), reach)
    weight = craters[:, 3] * craters[:, 2] ** 1.5 * (np.hypot(*craters[:, :2].T) < reach)
    rims = craters[rng.choice(len(craters), round(0.25 * len(lying)), p=weight / weight.sum())]
    away = 0.5 * rims[:, 2] * np.abs(rng.normal(1.25, 0.35, len(rims)))
    turn = rng.uniform(0, 2 * np.pi, len(rims))
    return np.concatenate([lying, rims[:, :2] + away[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])])
