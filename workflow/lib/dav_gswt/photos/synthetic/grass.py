"""The grass family: tall wild grass in stands, tussocks and ears, with trodden paths where it lies flat, from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import grasses, land, noise, scattering
from dav_gswt.photos.synthetic.land import Land, Light, smoothstep
from dav_gswt.photos.synthetic.scattering import CELLS, PERIOD

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.15, 0.112, 0.07])
THATCH = np.array([0.36, 0.305, 0.155])  # dead grass on the ground
FROM_AFAR = [0.85 * (t.green.mean(axis=0) * (1 - t.dry) + grasses.STRAW.mean(axis=0) * t.dry) for t in grasses.TINTS]
SUN = np.array([5.9, 5.05, 3.8])  # irradiance across the beam, in units of the exposure; so is the sky's radiance:
ZENITH = np.array([0.20, 0.31, 0.53])
HORIZON = np.array([0.70, 0.69, 0.64])
NEAR, MIDDLE, FAR = 8.5, 24.0, 70.0  # metres from the origin to which grass is laid in ever larger stands
SIZES = (0.5, 1.4, 3.0)  # metres across stands
KINDS = (4, 2, 1)  # stands of each tint
BLADES = (115, 520, 1500)  # of a stand
TRODDEN = (grasses.Tint(grasses.FRESH, 0.45), grasses.Tint(grasses.STRAW, 0.5), grasses.Tint(grasses.FRESH, 0.6))
REACH = 26.0  # metres from the origin to which tussocks and ears stand one by one


@dataclass(frozen=True)
class Options:
    """What a field of tall grass may vary in; BOUNDS holds the least and the greatest value of each."""

    undulation: float = 0.14  # metres, standard deviation of the rolling of the ground
    grass: float = 0.46  # metres, length of the grass where it is neither high nor low
    swirl: float = 0.9  # radians, standard deviation of the way the grass leans
    path: float = 0.50  # metres, half the width of a trodden path
    lain: float = 0.07  # share of the ground where grass lies flat besides paths
    straw: float = 0.24  # share of the ground where grass is ripe
    tussocks: float = 55.0  # on 100 square metres
    ears: float = 330.0  # plants in ear, on 100 square metres
    docks: float = 5.0  # on 100 square metres
    sun_elevation: float = 40.0  # degrees
    sun_azimuth: float = 150.0  # degrees from +x, where the sun stands


BOUNDS = {
    "undulation": (0.0, 0.5),
    "grass": (0.2, 0.8),
    "swirl": (0.0, 3.0),
    "path": (0.0, 1.0),
    "lain": (0.0, 0.6),
    "straw": (0.0, 0.6),
    "tussocks": (0.0, 300.0),
    "ears": (0.0, 1200.0),
    "docks": (0.0, 100.0),
    "sun_elevation": (10.0, 85.0),
    "sun_azimuth": (-360.0, 360.0),
}


def options(**given) -> Options:
    """Options with some values given. Raises: InputError: an unknown name or a value out of bounds, by name."""
    return land.options("grass", Options, BOUNDS, given)


@dataclass(frozen=True)
class Sward:
    """Rasters that say what grass there is: the share that stands, 0 to 1; how tall; which way it leans, as a vector
    along x and along y; and the share of each of grasses.TINTS, 1 in all.
    """

    stands: Float[Array, "n n"]
    tall: Float[Array, "n n"]
    lean: tuple[Float[Array, "n n"], Float[Array, "n n"]]
    tints: list[Float[Array, "n n"]]


def grow(o: Options, seed: int, exemplar: float) -> Land:
    """The field of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x6A55])
    sward = _sward(rng, o)
    albedo = _albedo(rng, sward)
    large = o.undulation * noise.band(rng, CELLS, PERIOD, longest=8.0, shortest=2.0, slope=1.8)
    small = 0.014 * noise.band(rng, 1024, PERIOD, longest=0.9, shortest=0.12, slope=1.0)
    height = land.levelled(lambda x, y: _height(x, y, large, small, o), exemplar)
    plants, places = [], []
    for kinds, found, yaw in _grown(rng, o, sward):
        which = len(plants) + rng.integers(0, len(kinds), len(found))
        plants += kinds
        places.append(scattering.standing(rng, which, found, height, yaw))
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.3 * np.mean(FROM_AFAR, axis=0))
    return Land(land.surface(height), albedo, PERIOD, None, plants, np.concatenate(places), light)


def _sward(rng, o: Options) -> Sward:
    trodden = _path(rng, o.path)
    lies = np.maximum(trodden, scattering.patches(rng, o.lain, 2.4) if o.lain else 0.0)
    tall = noise.band(rng, CELLS, PERIOD, 3.5, 0.5, 0.9)
    tall = np.clip(1.0 + 0.22 * tall, 0.55, 1.5)
    turn = np.radians(35.0) + o.swirl * noise.band(rng, CELLS, PERIOD, 7.0, 2.0, 1.2)
    ripe = scattering.patches(rng, o.straw, 4.5) if o.straw else np.zeros((CELLS, CELLS))
    blue = scattering.patches(rng, 0.22, 3.0) * (1 - ripe)
    lush = scattering.patches(rng, 0.45, 5.0) * (1 - ripe - blue)
    tints = [lush, 1 - ripe - blue - lush, blue, ripe]
    return Sward(1 - lies, tall, (np.cos(turn), np.sin(turn)), tints)


def _path(rng, half: float) -> Float[Array, "n n"]:
    """1 on a winding path through the exemplar, 0 off it.

    It is a contour of smooth noise, f = c: the distance to it is about |f - c| / |grad f|, and c is f at a place in the
    exemplar.
    """
    f = noise.band(rng, CELLS, PERIOD, 16.0, 5.0, 2.0)
    cell = PERIOD / CELLS
    slope = np.hypot(*(np.roll(f, -1, axis) - np.roll(f, 1, axis) for axis in (0, 1))) / (2 * cell)
    x, y = rng.uniform(-1.5, 1.5, (2, 1))
    away = np.abs(f - noise.sample(f, PERIOD, x, y)) / np.maximum(slope, 0.15)
    ragged = 1.0 + 0.25 * noise.band(rng, CELLS, PERIOD, 1.2, 0.2, 0.8)
    return 1 - smoothstep(0.75 * half, 1.25 * half, away * ragged) if half else np.zeros((CELLS, CELLS))


def _albedo(rng, sward: Sward) -> Float32[Array, "n n 3"]:
    """The ground's own colour: dead grass in fibres and some soil, tinted as the grass that stands on it."""
    n = TEXELS
    where = (np.arange(n) + 0.5) * PERIOD / n
    x, y = np.meshgrid(where, where)
    stands, *shares = (noise.sample(m, PERIOD, x, y)[..., None] for m in (sward.stands, *sward.tints))
    fibre = noise.band(rng, n, PERIOD, 0.12, 0.016, 0.3)[..., None]
    mottle = noise.band(rng, n, PERIOD, 1.0, 0.10, 0.7)[..., None]
    grown = sum(share * seen for share, seen in zip(shares, FROM_AFAR, strict=True))
    colour = THATCH + np.clip(0.85 * stands + 0.16 * fibre, 0, 1) * (grown - THATCH)
    bare = np.clip(0.12 + 0.2 * mottle - 0.1 * stands, 0, 0.8)
    shade = np.exp(0.12 * mottle + 0.14 * fibre)
    return np.clip((colour * (1 - bare) + SOIL * bare) * shade, 0.015, 0.8).astype(np.float32)


def _height(x, y, large, small, o: Options):
    """Ground height before it is levelled: rolling, hummocks near the middle, and far hills."""
    r = np.hypot(x, y)
    z = noise.sample(large, PERIOD, x, y) * (1 - smoothstep(16.0, 50.0, r))
    z = z + noise.sample(small, PERIOD, x, y) * (1 - smoothstep(7.0, 9.0, r))
    far = smoothstep(14.0, 130.0, r) * o.undulation * 13
    return z + far * (
        np.sin(0.037 * x - 0.021 * y + 2.1) + np.sin(0.023 * x + 0.043 * y) + 0.7 * np.sin(0.055 * y + 0.3)
    )


def _grown(rng, o: Options, sward: Sward):
    """What grows: kinds of plants, x, y, size and lie of each kind's plants, and their yaw or none."""
    yield from _laid(rng, o, sward)
    for share, tint in zip(sward.tints, grasses.TINTS, strict=True):
        where = sward.stands * share * scattering.patches(rng, 0.6, 2.5)
        found = scattering.strewn(rng, where, o.tussocks * share.mean(), (0.38, 0.72), REACH)
        yield [grasses.tussock(rng, tint) for _ in range(3)], found, None
    for ear in grasses.EARS:
        where = sward.stands * scattering.patches(rng, 0.45, 3.5)
        found = scattering.strewn(rng, where, o.ears / len(grasses.EARS), (0.48, 0.80), REACH)
        found[:, 2] *= np.clip(scattering.at(sward.tall)(*found[:, :2].T), 0.8, 1.15) * o.grass / 0.46
        yield [ear(rng) for _ in range(5)], found, None
    found = scattering.strewn(rng, sward.stands * scattering.patches(rng, 0.2, 3.0), o.docks, (0.55, 0.85), REACH)
    yield [grasses.dock(rng) for _ in range(3)], found, None


def _laid(rng, o: Options, sward: Sward):
    """Grass in three rings, laid without a gap: at every place it either lies or stands, and has one of the tints.

    The last ring is ever lower, so that it ends without an edge.
    """
    rings = zip((0.0, NEAR, MIDDLE), (NEAR, MIDDLE, FAR), SIZES, KINDS, BLADES, strict=True)
    for inner, outer, size, kinds, count in rings:
        found = scattering.laid(rng, lambda x, y: np.ones_like(x), inner, outer, size, overlap=0.2)
        x, y = found[:, :2].T
        shares = np.cumsum([scattering.at(sward.stands * share)(x, y) for share in sward.tints], axis=0)
        kind = (rng.uniform(size=len(found)) > shares).sum(axis=0)
        found[:, 2] *= 1 - 0.8 * smoothstep(0.55 * FAR, FAR, np.hypot(x, y))
        found[kind < len(shares), 2] *= (0.45 + 0.55 * scattering.at(sward.tall)(x, y))[kind < len(shares)]
        width = (0.0050 + 0.0015 * size) / size
        made = [[grasses.stand(rng, count, o.grass / size, width, t) for _ in range(kinds)] for t in grasses.TINTS]
        made.append([grasses.flat(rng, round(1.5 * count), 0.7 * o.grass / size, width, t) for t in TRODDEN])
        for k, grown in enumerate(made):
            yield grown, found[kind == k], _yaw(rng, sward, found[kind == k])


def _yaw(rng, sward: Sward, found):
    """The way that grass leans at places, as an angle."""
    x, y = (scattering.at(part)(*found[:, :2].T) for part in sward.lean)
    return np.arctan2(y, x) + rng.normal(0, 0.35, len(found))
