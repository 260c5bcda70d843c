"""The flowers family: a field of wild and garden flowers in drifts, on turf and bare soil, all from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import blooms, herbage, land, noise, scattering
from dav_gswt.photos.synthetic.land import Land, Light, smoothstep
from dav_gswt.photos.synthetic.meshes import Mesh
from dav_gswt.photos.synthetic.scattering import CELLS, PERIOD

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.135, 0.092, 0.06])
LITTER = np.array([0.21, 0.17, 0.085])
TURF = np.array([0.105, 0.165, 0.042])
FIELD = np.array([0.19, 0.165, 0.085])  # what far flowers and leaves together look like
STONE = (np.array([[0.40, 0.385, 0.35], [0.27, 0.26, 0.245], [0.46, 0.42, 0.36]]), SOIL)
SUN = np.array([4.9, 4.4, 3.55])  # irradiance across the beam, in units of the exposure; so is the sky's radiance:
ZENITH = np.array([0.16, 0.29, 0.58])
HORIZON = np.array([0.58, 0.67, 0.76])
NEAR, MIDDLE, FAR = 9.0, 28.0, 60.0  # metres from the origin to which plants stand singly, then in swathes
TURFS = ((0.5, 0.0, 9.0, 480, 4), (1.4, 9.0, 34.0, 1300, 3))  # mats: across, from, to, blades, kinds
SWATHES = ((1.4, NEAR, MIDDLE, 26, 2), (2.8, MIDDLE, FAR, 60, 1))  # across, from, to, plants, kinds


@dataclass(frozen=True)
class Sort:
    """A plant of the field: how to grow one, metres high, its share of all, of the ground, and its patches' length."""

    grow: Callable[[np.random.Generator], Mesh]
    heights: tuple[float, float]
    share: float
    spread: float
    longest: float


def _disc(kind: blooms.Kind, *where) -> Sort:
    return Sort(lambda rng: blooms.bush(rng, kind), kind.flower.heights, *where)


SORTS = (
    _disc(blooms.POPPY, 0.15, 0.34, 4.5),
    _disc(blooms.CORNFLOWER, 0.13, 0.28, 4.0),
    _disc(blooms.OXEYE, 0.17, 0.30, 4.0),
    _disc(blooms.BUTTERCUP, 0.16, 0.28, 3.0),
    _disc(blooms.COSMOS, 0.10, 0.22, 3.5),
    _disc(blooms.MARIGOLD, 0.09, 0.18, 2.5),
    _disc(blooms.DAISY, 0.10, 0.30, 2.5),
    Sort(lambda rng: blooms.spire(rng, blooms.LARKSPUR), (0.45, 0.72), 0.05, 0.16, 3.0),
    Sort(lambda rng: blooms.spire(rng, blooms.LUPIN), (0.42, 0.66), 0.03, 0.12, 3.0),
    Sort(blooms.umbel, (0.40, 0.66), 0.06, 0.30, 4.0),
)


@dataclass(frozen=True)
class Options:
    """What a field of flowers may vary in; BOUNDS holds the least and the greatest value of each."""

    undulation: float = 0.09  # metres, standard deviation of the rolling of the ground
    flowers: float = 1300.0  # flowering plants on 100 square metres
    bare: float = 0.22  # share of the ground where soil shows
    grass: float = 0.075  # metres, length of the grass between the flowers
    tufts: float = 140.0  # of taller grass, on 100 square metres
    stones: float = 9.0  # stones of 3 to 25 cm on 100 square metres
    pebbles: float = 150.0  # on 100 square metres
    sun_elevation: float = 50.0  # degrees
    sun_azimuth: float = 235.0  # degrees from +x, where the sun stands


BOUNDS = {
    "undulation": (0.0, 0.5),
    "flowers": (0.0, 3000.0),
    "bare": (0.0, 0.9),
    "grass": (0.02, 0.2),
    "tufts": (0.0, 600.0),
    "stones": (0.0, 500.0),
    "pebbles": (0.0, 4000.0),
    "sun_elevation": (10.0, 85.0),
    "sun_azimuth": (-360.0, 360.0),
}


def options(**given) -> Options:
    """Options with some values given. Raises: InputError: an unknown name or a value out of bounds, by name."""
    return land.options("flowers", Options, BOUNDS, given)


def grow(o: Options, seed: int, exemplar: float) -> Land:
    """The field of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0xF10E])
    soil = scattering.patches(rng, o.bare, 2.6, 0.2) if o.bare else np.zeros((CELLS, CELLS))
    albedo = _albedo(rng, soil)
    large = o.undulation * noise.band(rng, CELLS, PERIOD, longest=8.0, shortest=2.0, slope=1.8)
    small = 0.014 * noise.band(rng, 1024, PERIOD, longest=0.7, shortest=0.08, slope=0.9)
    height = land.levelled(lambda x, y: _height(x, y, large, small, o), exemplar)
    plants, places = [], []
    for kinds, found in _grown(rng, o, soil):
        which = len(plants) + rng.integers(0, len(kinds), len(found))
        plants += kinds
        places.append(scattering.standing(rng, which, found, height))
    stones = land.stones(rng, o.stones, o.pebbles, height, STONE)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * FIELD)
    return Land(land.surface(height), albedo, PERIOD, stones, plants, np.concatenate(places), light)


def _albedo(rng, soil) -> Float32[Array, "n n 3"]:
    """The ground's own colour: crumbly soil, and turf with dead leaves elsewhere."""
    n = TEXELS
    where = (np.arange(n) + 0.5) * PERIOD / n
    x, y = np.meshgrid(where, where)
    bare = noise.sample(soil, PERIOD, x, y)[..., None]
    crumb = noise.band(rng, n, PERIOD, 0.07, 0.012, 0.5)[..., None]
    fibre = noise.band(rng, n, PERIOD, 0.10, 0.016, 0.3)[..., None]
    mottle = noise.band(rng, n, PERIOD, 1.0, 0.10, 0.7)[..., None]
    turf = LITTER + np.clip(0.55 + 0.25 * fibre + 0.12 * mottle, 0, 1) * (TURF - LITTER)
    colour = turf * (1 - bare) + SOIL * bare
    return np.clip(colour * np.exp(0.18 * crumb + 0.12 * mottle), 0.015, 0.8).astype(np.float32)


def _height(x, y, large, small, o: Options):
    """Ground height before it is levelled: gently rolling, crumbly near the middle, and far hills."""
    r = np.hypot(x, y)
    z = noise.sample(large, PERIOD, x, y) * (1 - smoothstep(14.0, 45.0, r))
    z = z + noise.sample(small, PERIOD, x, y) * (1 - smoothstep(7.0, 9.0, r))
    far = smoothstep(14.0, 130.0, r) * o.undulation * 18
    return z + far * (
        np.sin(0.029 * x + 0.033 * y + 0.9) + np.sin(0.021 * x - 0.041 * y + 2.0) + 0.7 * np.sin(0.05 * y + 1.0)
    )


def _grown(rng, o: Options, soil: Float[Array, "n n"]):
    """What grows: kinds of plants, and for each kind's plants x, y, size and whether they follow the ground's slope."""
    for size, inner, outer, count, kinds in TURFS:
        mats = [herbage.mat(rng, count, o.grass / size, 0.16) for _ in range(kinds)]
        yield mats, scattering.laid(rng, scattering.thinning(scattering.at(1 - soil), 20.0, 34.0), inner, outer, size)
    tufts = scattering.strewn(rng, 1 - soil, o.tufts, (0.18, 0.42), 24.0)
    yield [herbage.tuft(rng) for _ in range(6)], tufts
    for sort in SORTS:
        yield from _flowering(rng, o, sort, soil)


def _flowering(rng, o: Options, sort: Sort, soil):
    """Plants of a sort, singly and dense in patches near the middle, in swathes beyond."""
    plants = [sort.grow(rng) for _ in range(5)]
    where = scattering.patches(rng, sort.spread, sort.longest) + 0.02
    where *= 1 - 0.75 * soil
    count = o.flowers * sort.share
    single = scattering.strewn(rng, where, count, sort.heights, 1.25 * NEAR)
    yield plants, single[np.hypot(*single[:, :2].T) < NEAR]
    thick = where * (count / 100 / where.mean())
    for size, inner, outer, many, kinds in SWATHES:
        made = [blooms.swathe(rng, plants, many, tuple(h / size for h in sort.heights)) for _ in range(kinds)]
        share = thick * size**2 * np.pi / 4 / many * 0.74**2 * 1.27
        found = scattering.laid(rng, scattering.thinning(scattering.at(share), 0.5 * FAR, FAR), inner, outer, size)
        found[:, 2] *= 1 - 0.5 * smoothstep(0.6 * FAR, FAR, np.hypot(*found[:, :2].T))
        yield made, found
