"""The meadow family: rolling ground under short grass, tufts, clover, flowers and a few stones."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, noise, plants
from dav_gswt.photos.synthetic.land import CELLS, PERIOD, FadingRaster, Hills, Land, Light, PlantGroup
from dav_gswt.photos.synthetic.noise import smoothstep

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.185, 0.135, 0.088])
THATCH = np.array([0.235, 0.205, 0.095])  # dead grass between the living
TURF = np.array([0.115, 0.165, 0.045])
STONE = (np.array([[0.40, 0.385, 0.35], [0.27, 0.26, 0.245], [0.50, 0.47, 0.41]]), np.array([0.30, 0.27, 0.19]))
LIGHT = Light(46.0, 215.0, (4.7, 4.3, 3.6), (0.17, 0.29, 0.54), (0.56, 0.64, 0.72), 0.4 * TURF)
NEAR = 8.5  # metres from the origin: small mats of short grass to there, large mats beyond
FAR = 34.0  # metres from the origin: no plants beyond
MAT, WIDE = 0.5, 1.4  # metres across small and large mats
GRASS = 0.055  # metres, length of the short grass
UNDULATION = 0.13  # metres, standard deviation
HILLS = Hills(
    (12.0, 120.0), (UNDULATION, 12.0), ((0.041, 0.023, 0.6, 1.0), (0.019, -0.047, 0.0, 1.0), (0.0, 0.06, 1.4, 0.7))
)
FLOWERING = (0.40, 0.33, 0.17, 0.10)  # share of each of MEADOW_FLOWERS


def make_land(seed: int, exemplar: float) -> Land:
    """The meadow of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x3EAD])
    worn = noise.make_noise(rng, CELLS, PERIOD, 3.0, 0.18, 1.1)
    edge = np.quantile(worn, 0.88)  # soil shows on 12 % of the ground
    spread = noise.make_noise(rng, CELLS, PERIOD, 5.5, 0.7, 1.2)
    cover = 1.0 - smoothstep(edge - 0.35, edge + 0.35, worn)
    lush = smoothstep(-1.3, 1.5, spread) * cover
    albedo = draw_sward(rng, cover, lush, TEXELS)
    large = UNDULATION * noise.make_noise(rng, 512, PERIOD, longest=7.5, shortest=2.0, slope=1.8)
    small = 0.012 * noise.make_noise(rng, 1024, PERIOD, longest=0.9, shortest=0.12, slope=1.0)
    relief = land.make_relief(FadingRaster(large, 14.0, 40.0), FadingRaster(small, 7.0, 9.0), HILLS)
    height = land.level_ground(relief, exemplar)
    kinds, places = land.place_plants(rng, _plant_groups(rng, cover, lush), height)
    stones = land.scatter_stones(rng, 7.0, 60.0, height, STONE)
    return Land(land.make_ground_mesh(height), albedo, PERIOD, stones, kinds, places, LIGHT)


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


def _plant_groups(rng, cover: Float[Array, "n n"], lush: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    thinning = 0.4 * FAR, FAR
    for share, dry in ((lush, 0.08), (cover - lush, 0.36)):
        density = land.interpolate(share)
        near = [plants.make_mat(rng, 560, GRASS / MAT, dry) for _ in range(5)]
        yield PlantGroup(near, land.lay_mats(rng, density, (0.0, NEAR), MAT, jitter=0.25))
        wide = [plants.make_mat(rng, 1500, 1.3 * GRASS / WIDE, dry) for _ in range(3)]
        yield PlantGroup(wide, land.lay_mats(rng, land.fade_out(density, *thinning), (NEAR, FAR), WIDE, jitter=0.25))
    tufts = [plants.make_tuft(rng) for _ in range(8)]
    heads = [plants.make_seed_grass(rng) for _ in range(6)]
    yield PlantGroup(tufts, land.scatter_plants(rng, lush, 260.0, (0.12, 0.30), thinning))
    yield PlantGroup(heads, land.scatter_plants(rng, lush, 90.0, (0.26, 0.50), thinning))
    clover, where = [plants.make_clover(rng) for _ in range(4)], land.make_patches(rng, 0.3, 2.5)
    yield PlantGroup(clover, land.scatter_plants(rng, where, 130.0, (0.07, 0.12), thinning, lies=1.0))
    for kind, share in zip(plants.MEADOW_FLOWERS, FLOWERING, strict=True):
        where = land.make_patches(rng, 0.35, 3.0) * (0.3 + 0.7 * cover)
        flowers = [plants.make_flower(rng, kind) for _ in range(4)]
        yield PlantGroup(flowers, land.scatter_plants(rng, where, 270.0 * share, kind.heights, thinning))
