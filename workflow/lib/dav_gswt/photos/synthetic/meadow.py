"""The meadow family: rolling ground under short grass, tufts, clover, flowers and a few stones, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import herbage, land, noise
from dav_gswt.photos.synthetic.land import Height, Land, Light, smoothstep, sown

PERIOD = 16.0  # metres after which the ground's colours and what grows where repeat; far hills do not
TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.185, 0.135, 0.088])
THATCH = np.array([0.235, 0.205, 0.095])  # dead grass between the living
TURF = np.array([0.115, 0.165, 0.045])
STONE = (np.array([[0.40, 0.385, 0.35], [0.27, 0.26, 0.245], [0.50, 0.47, 0.41]]), np.array([0.30, 0.27, 0.19]))
SUN = np.array([4.7, 4.3, 3.6])  # irradiance across the beam, in units of the exposure; so is the sky's radiance:
ZENITH = np.array([0.17, 0.29, 0.54])
HORIZON = np.array([0.56, 0.64, 0.72])
NEAR = 8.5  # metres from the origin to which short grass is laid in small mats; beyond, in large ones
FAR = 34.0  # metres from the origin beyond which nothing stands: colour alone
MAT, WIDE = 0.5, 1.4  # metres across small and large mats
COVER = 512  # cells a side of the rasters that say what grows where
FLOWERING = (0.40, 0.33, 0.17, 0.10)  # share of each kind of herbage.FLOWERS


@dataclass(frozen=True)
class Options:
    """What a meadow may vary in; BOUNDS holds the least and the greatest value of each."""

    undulation: float = 0.13  # metres, standard deviation of the rolling of the ground
    grass: float = 0.055  # metres, length of the short grass
    bare: float = 0.12  # share of the ground where soil shows
    tufts: float = 260.0  # on 100 square metres
    seed_heads: float = 90.0  # plants of grass in seed, on 100 square metres
    clover: float = 130.0  # on 100 square metres
    flowers: float = 270.0  # plants, on 100 square metres
    stones: float = 7.0  # stones of 3 to 25 cm on 100 square metres
    pebbles: float = 60.0  # on 100 square metres
    sun_elevation: float = 46.0  # degrees
    sun_azimuth: float = 215.0  # degrees from +x, where the sun stands


BOUNDS = {
    "undulation": (0.0, 0.5),
    "grass": (0.02, 0.12),
    "bare": (0.0, 1.0),
    "tufts": (0.0, 1000.0),
    "seed_heads": (0.0, 600.0),
    "clover": (0.0, 600.0),
    "flowers": (0.0, 1000.0),
    "stones": (0.0, 500.0),
    "pebbles": (0.0, 4000.0),
    "sun_elevation": (10.0, 85.0),
    "sun_azimuth": (-360.0, 360.0),
}


def options(**given) -> Options:
    """Options with some values given. Raises: InputError: an unknown name or a value out of bounds, by name."""
    return land.options("meadow", Options, BOUNDS, given)


def grow(o: Options, seed: int, exemplar: float) -> Land:
    """The meadow of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x3EAD])
    cover, lush = _cover(rng, o)
    albedo = _albedo(rng, cover, lush)
    large = o.undulation * noise.band(rng, 512, PERIOD, longest=7.5, shortest=2.0, slope=1.8)
    small = 0.012 * noise.band(rng, 1024, PERIOD, longest=0.9, shortest=0.12, slope=1.0)
    height = land.levelled(lambda x, y: _height(x, y, large, small, o), exemplar)
    plants, places = [], []
    for kinds, found in _grown(rng, o, cover, lush):
        which = len(plants) + rng.integers(0, len(kinds), len(found))
        plants += kinds
        places.append(_standing(rng, which, found, height))
    stones = land.stones(rng, o.stones, o.pebbles, height, STONE)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * TURF)
    return Land(land.surface(height), albedo, PERIOD, stones, plants, np.concatenate(places), light)


def _cover(rng, o: Options) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """How far grass covers the ground, 0 (soil) to 1, and how much of it is lush, never more than that."""
    n = COVER
    worn = noise.band(rng, n, PERIOD, 3.0, 0.18, 1.1)
    edge = np.quantile(worn, 1 - o.bare)
    spread = noise.band(rng, n, PERIOD, 5.5, 0.7, 1.2)
    cover = 1.0 - smoothstep(edge - 0.35, edge + 0.35, worn) if 0 < o.bare < 1 else np.full((n, n), 1.0 - o.bare)
    return cover, smoothstep(-1.3, 1.5, spread) * cover


def _albedo(rng, cover, lush) -> Float32[Array, "n n 3"]:
    """The ground's own colour: soil, dead grass and turf, in fibres and crumbs as fine as a texel."""
    n = TEXELS
    at = (np.arange(n) + 0.5) * PERIOD / n
    x, y = np.meshgrid(at, at)
    cover, lush = (noise.sample(m, PERIOD, x, y)[..., None] for m in (cover, lush))
    grain = noise.band(rng, n, PERIOD, 0.05, 0.012, 0.4)[..., None]
    fibre = noise.band(rng, n, PERIOD, 0.10, 0.016, 0.3)[..., None]
    mottle = noise.band(rng, n, PERIOD, 1.0, 0.10, 0.7)[..., None]
    green = np.clip(0.35 + 0.5 * lush + 0.22 * fibre + 0.10 * mottle, 0, 1)
    sward = THATCH + green * (TURF - THATCH)
    colour = SOIL * (1 - cover) + sward * cover
    shade = np.exp(0.16 * grain + 0.10 * mottle + 0.08 * fibre)
    return np.clip(colour * shade, 0.015, 0.8).astype(np.float32)


def _height(x, y, large, small, o: Options):
    """Ground height before it is levelled: rolling, hummocks near the middle, and far hills."""
    r = np.hypot(x, y)
    z = noise.sample(large, PERIOD, x, y) * (1 - smoothstep(14.0, 40.0, r))
    z = z + noise.sample(small, PERIOD, x, y) * (1 - smoothstep(7.0, 9.0, r))
    far = smoothstep(12.0, 120.0, r) * o.undulation * 12
    return z + far * (
        np.sin(0.041 * x + 0.023 * y + 0.6) + np.sin(0.019 * x - 0.047 * y) + 0.7 * np.sin(0.06 * y + 1.4)
    )


def _grown(rng, o: Options, cover, lush):
    """What grows: kinds of plants, and for each kind's plants x, y, size and whether they follow the ground's slope."""
    for share, dry in ((lush, 0.08), (cover - lush, 0.36)):
        near = [herbage.mat(rng, 560, o.grass / MAT, dry) for _ in range(5)]
        yield near, _laid(rng, _at(share), 0.0, NEAR, MAT)
        wide = [herbage.mat(rng, 1500, 1.3 * o.grass / WIDE, dry) for _ in range(3)]
        yield wide, _laid(rng, _thinning(_at(share)), NEAR, FAR, WIDE)
    tufts, heads = [herbage.tuft(rng) for _ in range(8)], [herbage.in_seed(rng) for _ in range(6)]
    yield tufts, _strewn(rng, lush, o.tufts, (0.12, 0.30), 0.0)
    yield heads, _strewn(rng, lush, o.seed_heads, (0.26, 0.50), 0.0)
    yield [herbage.clover(rng) for _ in range(4)], _strewn(rng, _patches(rng, 0.3, 2.5), o.clover, (0.07, 0.12), 1.0)
    for kind, share in zip(herbage.FLOWERS, FLOWERING, strict=True):
        where = _patches(rng, 0.35, 3.0) * (0.3 + 0.7 * cover)
        yield [herbage.flower(rng, kind) for _ in range(4)], _strewn(rng, where, o.flowers * share, kind.heights, 0.0)


def _patches(rng, share: float, longest: float) -> Float[Array, "n n"]:
    """1 in patches that hold about `share` of the ground, 0 elsewhere, smooth between."""
    raster = noise.band(rng, COVER, PERIOD, longest, 0.35, 1.1)
    return smoothstep(*np.quantile(raster, [1 - 1.6 * share, 1 - 0.4 * share]), raster)


def _at(raster) -> Height:
    return lambda x, y: noise.sample(raster, PERIOD, x, y)


def _thinning(density: Height) -> Height:
    """Less and less of it towards FAR."""
    return lambda x, y: density(x, y) * (1 - smoothstep(0.4 * FAR, FAR, np.hypot(x, y)))


def _laid(rng, density: Height, inner: float, outer: float, size: float) -> Float[Array, "n 4"]:
    """Mats on a jittered grid in a ring about the origin, left out as `density` falls from 1."""
    spacing = 0.74 * size
    axis = np.arange(-outer, outer, spacing)
    x, y = (v.ravel() + rng.uniform(-0.25, 0.25, v.size) * spacing for v in np.meshgrid(axis, axis))
    r = np.hypot(x, y)
    stays = (rng.uniform(size=x.size) < density(x, y)) & (r >= inner) & (r < outer)
    x, y = x[stays], y[stays]
    return np.column_stack([x, y, size * rng.uniform(0.85, 1.2, x.size), np.ones(x.size)])


def _strewn(rng, where, count: float, sizes: tuple[float, float], lies: float) -> Float[Array, "n 4"]:
    """Plants in proportion to the raster `where`, on average `count` on 100 square metres near the origin."""
    share = where * (count / 100 / max(where.mean(), 1e-9))
    at = sown(rng, _thinning(_at(share)), share.max(), FAR)
    return np.column_stack([at, rng.uniform(*sizes, len(at)), np.full(len(at), lies)])


def _standing(rng, which, found, height: Height) -> Float[Array, "n 8"]:
    """Rows of Land.places for things at x, y of a size; those whose last column is 1 follow the ground's slope."""
    x, y, size, lies = found.T
    reach = 0.5 * size + 0.01
    along_x = lies * (height(x + reach, y) - height(x - reach, y)) / (2 * reach)
    along_y = lies * (height(x, y + reach) - height(x, y - reach)) / (2 * reach)
    return np.column_stack([which, x, y, height(x, y), size, rng.uniform(0, 2 * np.pi, len(x)), along_x, along_y])
