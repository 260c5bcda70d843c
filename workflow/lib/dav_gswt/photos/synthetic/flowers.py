"""The flowers family: a field of wild and garden flowers in patches, on turf and bare soil, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import flower_plants, land, meadow_plants, noise, scattering
from dav_gswt.photos.synthetic.land import FamilyOptions, Land, Light, option, smoothstep
from dav_gswt.photos.synthetic.meshes import Mesh
from dav_gswt.photos.synthetic.scattering import CELLS, PERIOD, PlantGroup

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.135, 0.092, 0.06])
LITTER = np.array([0.21, 0.17, 0.085])
TURF = np.array([0.105, 0.165, 0.042])
FIELD = np.array([0.19, 0.165, 0.085])  # mean of far flowers and leaves
STONE = (np.array([[0.40, 0.385, 0.35], [0.27, 0.26, 0.245], [0.46, 0.42, 0.36]]), SOIL)
SUN = np.array([4.9, 4.4, 3.55])  # irradiance across the beam; like the sky's radiance in units of the exposure
ZENITH = np.array([0.16, 0.29, 0.58])
HORIZON = np.array([0.58, 0.67, 0.76])
NEAR, MIDDLE, FAR = 9.0, 28.0, 60.0  # metres: single plants to NEAR, then swathes of many
HILLS = ((0.029, 0.033, 0.9, 1.0), (0.021, -0.041, 2.0, 1.0), (0.0, 0.05, 1.0, 0.7))
TURFS = ((0.5, 0.0, 9.0, 480, 4), (1.4, 9.0, 34.0, 1300, 3))  # mats: across, from, to, blades, kinds
SWATHES = ((1.4, NEAR, MIDDLE, 26, 2), (2.8, MIDDLE, FAR, 60, 1))  # across, from, to, plants, kinds


@dataclass(frozen=True)
class Sort:
    """A sort of plant. make: one plant. heights: metres. share: of all plants. spread: share of the ground that its
    patches hold. longest: wavelength of the patches in metres."""

    make: Callable[[np.random.Generator], Mesh]
    heights: tuple[float, float]
    share: float
    spread: float
    longest: float


def _bush_sort(kind: flower_plants.Kind, share: float, spread: float, longest: float) -> Sort:
    return Sort(lambda rng: flower_plants.make_bush(rng, kind), kind.flower.heights, share, spread, longest)


SORTS = (
    _bush_sort(flower_plants.POPPY, 0.15, 0.34, 4.5),
    _bush_sort(flower_plants.CORNFLOWER, 0.13, 0.28, 4.0),
    _bush_sort(flower_plants.OXEYE, 0.17, 0.30, 4.0),
    _bush_sort(flower_plants.BUTTERCUP, 0.16, 0.28, 3.0),
    _bush_sort(flower_plants.COSMOS, 0.10, 0.22, 3.5),
    _bush_sort(flower_plants.MARIGOLD, 0.09, 0.18, 2.5),
    _bush_sort(flower_plants.DAISY, 0.10, 0.30, 2.5),
    Sort(lambda rng: flower_plants.make_spire(rng, flower_plants.LARKSPUR), (0.45, 0.72), 0.05, 0.16, 3.0),
    Sort(lambda rng: flower_plants.make_spire(rng, flower_plants.LUPIN), (0.42, 0.66), 0.03, 0.12, 3.0),
    Sort(flower_plants.make_umbel, (0.40, 0.66), 0.06, 0.30, 4.0),
)


@dataclass(frozen=True)
class Options(FamilyOptions):
    """What a field of flowers may vary in: default, least and greatest value."""

    undulation: float = option(0.09, 0.0, 0.5)  # metres, standard deviation of the rolling of the ground
    flowers: float = option(1300.0, 0.0, 3000.0)  # flowering plants on 100 square metres
    bare: float = option(0.22, 0.0, 0.9)  # share of the ground where soil shows
    grass: float = option(0.075, 0.02, 0.2)  # metres, length of the grass between the flowers
    tufts: float = option(140.0, 0.0, 600.0)  # of taller grass, on 100 square metres
    stones: float = option(9.0, 0.0, 500.0)  # stones of 3 to 25 cm on 100 square metres
    pebbles: float = option(150.0, 0.0, 4000.0)  # on 100 square metres
    sun_elevation: float = option(50.0, 10.0, 85.0)  # degrees
    sun_azimuth: float = option(235.0, -360.0, 360.0)  # degrees from +x, where the sun stands


def make_land(o: Options, seed: int, exemplar: float) -> Land:
    """The field of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0xF10E])
    soil = scattering.make_patches(rng, o.bare, 2.6, 0.2) if o.bare else np.zeros((CELLS, CELLS))
    albedo = _albedo(rng, soil)
    large = o.undulation * noise.make_noise(rng, CELLS, PERIOD, longest=8.0, shortest=2.0, slope=1.8)
    small = 0.014 * noise.make_noise(rng, 1024, PERIOD, longest=0.7, shortest=0.08, slope=0.9)
    height = land.level_ground(lambda x, y: _height(x, y, large, small, o), exemplar)
    plants, places = scattering.place_plants(rng, _plant_groups(rng, o, soil), height)
    stones = land.scatter_stones(rng, o.stones, o.pebbles, height, STONE)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * FIELD)
    return Land(land.make_ground_mesh(height), albedo, PERIOD, stones, plants, places, light)


def _albedo(rng, soil) -> Float32[Array, "n n 3"]:
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


def _height(x, y, large, small, o: Options):
    """Ground height before levelling: gently rolling, crumbly near the middle, and far hills."""
    z = land.fade_raster(large, PERIOD, x, y, 14.0, 45.0) + land.fade_raster(small, PERIOD, x, y, 7.0, 9.0)
    return z + land.sum_hills(x, y, (14.0, 130.0), (o.undulation, 18.0), HILLS)


def _plant_groups(rng, o: Options, soil: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    for size, inner, outer, count, kinds in TURFS:
        mats = [meadow_plants.make_mat(rng, count, o.grass / size, 0.16) for _ in range(kinds)]
        cover = scattering.fade_out(scattering.interpolate(1 - soil), 20.0, 34.0)
        yield PlantGroup(mats, scattering.lay_mats(rng, cover, (inner, outer), size))
    tufts = scattering.scatter_plants(rng, 1 - soil, o.tufts, (0.18, 0.42), (0.7 * 24.0, 24.0))
    yield PlantGroup([meadow_plants.make_tuft(rng) for _ in range(6)], tufts)
    for sort in SORTS:
        yield from _flowering(rng, o, sort, soil)


def _flowering(rng, o: Options, sort: Sort, soil: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    """Plants of a sort: single and dense in patches near the origin, swathes beyond."""
    plants = [sort.make(rng) for _ in range(5)]
    where = scattering.make_patches(rng, sort.spread, sort.longest) + 0.02
    where *= 1 - 0.75 * soil
    count = o.flowers * sort.share
    end = 1.25 * NEAR
    single = scattering.scatter_plants(rng, where, count, sort.heights, (0.7 * end, end))
    yield PlantGroup(plants, single[np.hypot(*single[:, :2].T) < NEAR])
    thick = where * (count / 100 / where.mean())
    for size, inner, outer, many, kinds in SWATHES:
        heights = sort.heights[0] / size, sort.heights[1] / size
        swathes = [flower_plants.make_swathe(rng, plants, many, heights) for _ in range(kinds)]
        share = thick * size**2 * np.pi / 4 / many * 0.74**2 * 1.27
        density = scattering.fade_out(scattering.interpolate(share), 0.5 * FAR, FAR)
        rows = scattering.lay_mats(rng, density, (inner, outer), size)
        rows[:, 2] *= 1 - 0.5 * smoothstep(0.6 * FAR, FAR, np.hypot(*rows[:, :2].T))
        yield PlantGroup(swathes, rows)
