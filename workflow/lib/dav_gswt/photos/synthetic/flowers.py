"""The flowers family: a field of wild and garden flowers in patches, on turf and bare soil."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, noise, plants
from dav_gswt.photos.synthetic.land import CELLS, PERIOD, FadingRaster, Hills, Land, Light, PlantGroup
from dav_gswt.photos.synthetic.noise import smoothstep
from dav_gswt.photos.synthetic.plants import Flower

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.135, 0.092, 0.06])
LITTER = np.array([0.21, 0.17, 0.085])
TURF = np.array([0.105, 0.165, 0.042])
STONE = (np.array([[0.40, 0.385, 0.35], [0.27, 0.26, 0.245], [0.46, 0.42, 0.36]]), SOIL)
LIGHT = Light(
    50.0, 235.0, (4.9, 4.4, 3.55), (0.16, 0.29, 0.58), (0.58, 0.67, 0.76), 0.4 * np.array([0.19, 0.165, 0.085])
)  # the mean of far flowers and leaves
UNDULATION = 0.09  # metres, standard deviation
HILLS = Hills(
    (14.0, 130.0), (UNDULATION, 18.0), ((0.029, 0.033, 0.9, 1.0), (0.021, -0.041, 2.0, 1.0), (0.0, 0.05, 1.0, 0.7))
)
GRASS = 0.075  # metres, length of the grass between the flowers
FLOWERS = 1300.0  # flowering plants on 100 square metres
STEMS = 9  # of a plant, at most
NEAR, MIDDLE, FAR = 9.0, 28.0, 60.0  # metres: single plants to NEAR, then swathes of many
TURFS = ((0.5, 0.0, 9.0, 480, 4), (1.4, 9.0, 34.0, 1300, 3))  # mats: across, from, to, blades, kinds
SWATHES = ((1.4, NEAR, MIDDLE, 26, 2), (2.8, MIDDLE, FAR, 60, 1))  # across, from, to, plants, kinds


WHITE, YOLK, DARK = (0.82, 0.81, 0.77), (0.68, 0.43, 0.03), (0.045, 0.03, 0.04)
# the flower, its share of all plants, the share of the ground that its patches hold, and their wavelength in metres
SORTS = (
    (Flower(5, 0.088, 0.62, 0.50, 0.24, (0.66, 0.035, 0.02), DARK, (0.36, 0.60)), 0.17, 0.34, 4.5),  # poppy
    (Flower(11, 0.054, 0.26, 0.40, 0.34, (0.10, 0.12, 0.62), (0.12, 0.05, 0.30), (0.40, 0.64)), 0.15, 0.28, 4.0),
    (Flower(16, 0.070, 0.16, -0.06, 0.34, WHITE, YOLK, (0.34, 0.54)), 0.18, 0.30, 4.0),  # oxeye daisy
    (Flower(5, 0.050, 0.50, 0.40, 0.26, (0.82, 0.60, 0.015), (0.62, 0.48, 0.03), (0.28, 0.50)), 0.18, 0.28, 3.0),
    (Flower(8, 0.075, 0.36, 0.12, 0.20, (0.74, 0.17, 0.43), YOLK, (0.40, 0.62)), 0.12, 0.22, 3.5),  # cosmos
    (Flower(19, 0.120, 0.14, 0.15, 0.32, (0.86, 0.32, 0.015), (0.50, 0.19, 0.02), (0.20, 0.32)), 0.10, 0.18, 2.5),
    (Flower(17, 0.125, 0.12, 0.04, 0.36, WHITE, (0.72, 0.52, 0.04), (0.09, 0.16)), 0.10, 0.30, 2.5),  # daisy
)


def make_land(seed: int, exemplar: float) -> Land:
    """The field of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0xF10E])
    soil = land.make_patches(rng, 0.22, 2.6, 0.2)
    albedo = _draw_albedo(rng, soil)
    large = UNDULATION * noise.make_noise(rng, CELLS, PERIOD, longest=8.0, shortest=2.0, slope=1.8)
    small = 0.014 * noise.make_noise(rng, 1024, PERIOD, longest=0.7, shortest=0.08, slope=0.9)
    relief = land.make_relief(FadingRaster(large, 14.0, 45.0), FadingRaster(small, 7.0, 9.0), HILLS)
    height = land.level_ground(relief, exemplar)
    kinds, places = land.place_plants(rng, _plant_groups(rng, soil), height)
    stones = land.scatter_stones(rng, 9.0, 150.0, height, STONE)
    return Land(land.make_ground_mesh(height), albedo, PERIOD, stones, kinds, places, LIGHT)


def _draw_albedo(rng, soil) -> Float32[Array, "n n 3"]:
    """The ground's own colour: crumbly soil, and turf with dead leaves elsewhere."""
    n = TEXELS
    x, y = noise.texel_centres(n, PERIOD)
    bare = noise.sample_raster(soil, PERIOD, x, y)[..., None]
    crumb = noise.make_noise(rng, n, PERIOD, 0.07, 0.012, 0.5)[..., None]
    fibre = noise.make_noise(rng, n, PERIOD, 0.10, 0.016, 0.3)[..., None]
    mottle = noise.make_noise(rng, n, PERIOD, 1.0, 0.10, 0.7)[..., None]
    turf = LITTER + np.clip(0.55 + 0.25 * fibre + 0.12 * mottle, 0, 1) * (TURF - LITTER)
    colour = turf * (1 - bare) + SOIL * bare
    return np.clip(colour * np.exp(0.18 * crumb + 0.12 * mottle), 0.015, 0.8).astype(np.float32)


def _plant_groups(rng, soil: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    for size, inner, outer, count, kinds in TURFS:
        mats = [plants.make_mat(rng, count, GRASS / size, 0.16) for _ in range(kinds)]
        cover = land.fade_out(land.interpolate(1 - soil), 20.0, 34.0)
        yield PlantGroup(mats, land.lay_mats(rng, cover, (inner, outer), size))
    tufts = land.scatter_plants(rng, 1 - soil, 140.0, (0.18, 0.42), (0.7 * 24.0, 24.0))
    yield PlantGroup([plants.make_tuft(rng) for _ in range(6)], tufts)
    for flower, share, spread, longest in SORTS:
        where = (land.make_patches(rng, spread, longest) + 0.02) * (1 - 0.75 * soil)
        yield from _flowering(rng, flower, FLOWERS * share, where)


def _flowering(rng, flower: Flower, count: float, where: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    """Plants of a sort: single and dense in patches near the origin, swathes beyond."""
    kinds = [plants.make_flower(rng, flower, STEMS) for _ in range(5)]
    end = 1.25 * NEAR
    single = land.scatter_plants(rng, where, count, flower.heights, (0.7 * end, end))
    yield PlantGroup(kinds, single[np.hypot(*single[:, :2].T) < NEAR])
    thick = where * (count / 100 / where.mean())
    for size, inner, outer, many, different in SWATHES:
        heights = flower.heights[0] / size, flower.heights[1] / size
        swathes = [plants.make_swathe(rng, kinds, many, heights) for _ in range(different)]
        share = thick * size**2 * np.pi / 4 / many * 0.74**2 * 1.27
        density = land.fade_out(land.interpolate(share), 0.5 * FAR, FAR)
        rows = land.lay_mats(rng, density, (inner, outer), size)
        rows[:, 2] *= 1 - 0.5 * smoothstep(0.6 * FAR, FAR, np.hypot(*rows[:, :2].T))
        yield PlantGroup(swathes, rows)
