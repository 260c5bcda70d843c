"""The meadow family: rolling ground under short grass, tufts, clover, flowers and a few stones, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, meadow_plants, noise, scattering
from dav_gswt.photos.synthetic.land import FamilyOptions, Land, Light, option, smoothstep
from dav_gswt.photos.synthetic.scattering import CELLS, PERIOD, PlantGroup

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.185, 0.135, 0.088])
THATCH = np.array([0.235, 0.205, 0.095])  # dead grass between the living
TURF = np.array([0.115, 0.165, 0.045])
STONE = (np.array([[0.40, 0.385, 0.35], [0.27, 0.26, 0.245], [0.50, 0.47, 0.41]]), np.array([0.30, 0.27, 0.19]))
SUN = np.array([4.7, 4.3, 3.6])  # irradiance across the beam; like the sky's radiance in units of the exposure
ZENITH = np.array([0.17, 0.29, 0.54])
HORIZON = np.array([0.56, 0.64, 0.72])
NEAR = 8.5  # metres from the origin: small mats of short grass to there, large mats beyond
FAR = 34.0  # metres from the origin: no plants beyond
MAT, WIDE = 0.5, 1.4  # metres across small and large mats
HILLS = ((0.041, 0.023, 0.6, 1.0), (0.019, -0.047, 0.0, 1.0), (0.0, 0.06, 1.4, 0.7))
FLOWERING = (0.40, 0.33, 0.17, 0.10)  # share of each kind of meadow_plants.FLOWERS


@dataclass(frozen=True)
class Options(FamilyOptions):
    """What a meadow may vary in: default, least and greatest value."""

    undulation: float = option(0.13, 0.0, 0.5)  # metres, standard deviation of the rolling of the ground
    grass: float = option(0.055, 0.02, 0.12)  # metres, length of the short grass
    bare: float = option(0.12, 0.0, 1.0)  # share of the ground where soil shows
    tufts: float = option(260.0, 0.0, 1000.0)  # on 100 square metres
    seed_heads: float = option(90.0, 0.0, 600.0)  # plants of grass in seed, on 100 square metres
    clover: float = option(130.0, 0.0, 600.0)  # on 100 square metres
    flowers: float = option(270.0, 0.0, 1000.0)  # plants, on 100 square metres
    stones: float = option(7.0, 0.0, 500.0)  # stones of 3 to 25 cm on 100 square metres
    pebbles: float = option(60.0, 0.0, 4000.0)  # on 100 square metres
    sun_elevation: float = option(46.0, 10.0, 85.0)  # degrees
    sun_azimuth: float = option(215.0, -360.0, 360.0)  # degrees from +x, where the sun stands


def make_land(o: Options, seed: int, exemplar: float) -> Land:
    """The meadow of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x3EAD])
    cover, lush = _draw_cover(rng, o)
    albedo = draw_sward(rng, cover, lush, TEXELS)
    large = o.undulation * noise.make_noise(rng, 512, PERIOD, longest=7.5, shortest=2.0, slope=1.8)
    small = 0.012 * noise.make_noise(rng, 1024, PERIOD, longest=0.9, shortest=0.12, slope=1.0)
    height = land.level_ground(lambda x, y: _height(x, y, large, small, o), exemplar)
    plants, places = scattering.place_plants(rng, _plant_groups(rng, o, cover, lush), height)
    stones = land.scatter_stones(rng, o.stones, o.pebbles, height, STONE)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * TURF)
    return Land(land.make_ground_mesh(height), albedo, PERIOD, stones, plants, places, light)


def _draw_cover(rng, o: Options) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """How far grass covers the ground, 0 (soil) to 1, and how much of it is lush, never more than that."""
    n = CELLS
    worn = noise.make_noise(rng, n, PERIOD, 3.0, 0.18, 1.1)
    edge = np.quantile(worn, 1 - o.bare)
    spread = noise.make_noise(rng, n, PERIOD, 5.5, 0.7, 1.2)
    cover = 1.0 - smoothstep(edge - 0.35, edge + 0.35, worn) if 0 < o.bare < 1 else np.full((n, n), 1.0 - o.bare)
    return cover, smoothstep(-1.3, 1.5, spread) * cover


def draw_sward(rng, cover, lush, n: int) -> Float32[Array, "n n 3"]:
    """The ground's own colour: soil, dead grass and turf, in fibres and crumbs as fine as a texel. n: texels a side."""
    x, y = noise.texel_centres(n, PERIOD)
    cover, lush = (noise.sample_raster(m, PERIOD, x, y)[..., None] for m in (cover, lush))
    grain = noise.make_noise(rng, n, PERIOD, 0.05, 0.012, 0.4)[..., None]
    fibre = noise.make_noise(rng, n, PERIOD, 0.10, 0.016, 0.3)[..., None]
    mottle = noise.make_noise(rng, n, PERIOD, 1.0, 0.10, 0.7)[..., None]
    green = np.clip(0.35 + 0.5 * lush + 0.22 * fibre + 0.10 * mottle, 0, 1)
    sward = THATCH + green * (TURF - THATCH)
    colour = SOIL * (1 - cover) + sward * cover
    shade = np.exp(0.16 * grain + 0.10 * mottle + 0.08 * fibre)
    return np.clip(colour * shade, 0.015, 0.8).astype(np.float32)


def _height(x, y, large, small, o: Options):
    """Ground height before levelling: rolling, hummocks near the middle, and far hills."""
    z = land.fade_raster(large, PERIOD, x, y, 14.0, 40.0) + land.fade_raster(small, PERIOD, x, y, 7.0, 9.0)
    return z + land.sum_hills(x, y, (12.0, 120.0), (o.undulation, 12.0), HILLS)


def _plant_groups(rng, o: Options, cover: Float[Array, "n n"], lush: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    thinning = 0.4 * FAR, FAR
    for share, dry in ((lush, 0.08), (cover - lush, 0.36)):
        density = scattering.interpolate(share)
        near = [meadow_plants.make_mat(rng, 560, o.grass / MAT, dry) for _ in range(5)]
        yield PlantGroup(near, scattering.lay_mats(rng, density, (0.0, NEAR), MAT, jitter=0.25))
        wide = [meadow_plants.make_mat(rng, 1500, 1.3 * o.grass / WIDE, dry) for _ in range(3)]
        thinned = scattering.fade_out(density, *thinning)
        yield PlantGroup(wide, scattering.lay_mats(rng, thinned, (NEAR, FAR), WIDE, jitter=0.25))
    tufts = [meadow_plants.make_tuft(rng) for _ in range(8)]
    heads = [meadow_plants.make_seed_grass(rng) for _ in range(6)]
    yield PlantGroup(tufts, scattering.scatter_plants(rng, lush, o.tufts, (0.12, 0.30), thinning))
    yield PlantGroup(heads, scattering.scatter_plants(rng, lush, o.seed_heads, (0.26, 0.50), thinning))
    clover, where = [meadow_plants.make_clover(rng) for _ in range(4)], scattering.make_patches(rng, 0.3, 2.5)
    yield PlantGroup(clover, scattering.scatter_plants(rng, where, o.clover, (0.07, 0.12), thinning, lies=1.0))
    for kind, share in zip(meadow_plants.FLOWERS, FLOWERING, strict=True):
        where = scattering.make_patches(rng, 0.35, 3.0) * (0.3 + 0.7 * cover)
        flowers = [meadow_plants.make_flower(rng, kind) for _ in range(4)]
        yield PlantGroup(flowers, scattering.scatter_plants(rng, where, o.flowers * share, kind.heights, thinning))
