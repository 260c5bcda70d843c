"""The grass family: tall wild grass in stands and ears, with trodden paths where it lies flat."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import land, noise, plants
from dav_gswt.photos.synthetic.land import CELLS, PERIOD, FadingRaster, Hills, Land, Light, PlantGroup
from dav_gswt.photos.synthetic.noise import smoothstep
from dav_gswt.photos.synthetic.plants import STRAW, TINTS

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.15, 0.112, 0.07])
THATCH = np.array([0.36, 0.305, 0.155])  # dead grass on the ground
FROM_AFAR = [0.85 * (t.green.mean(axis=0) * (1 - t.dry) + STRAW.mean(axis=0) * t.dry) for t in TINTS]
LIGHT = Light(40.0, 150.0, (5.9, 5.05, 3.8), (0.20, 0.31, 0.53), (0.70, 0.69, 0.64), 0.3 * np.mean(FROM_AFAR, axis=0))
UNDULATION = 0.14  # metres, standard deviation
HILLS = Hills(
    (14.0, 130.0), (UNDULATION, 13.0), ((0.037, -0.021, 2.1, 1.0), (0.023, 0.043, 0.0, 1.0), (0.0, 0.055, 0.3, 0.7))
)
GRASS = 0.46  # metres, length of the grass where it is neither high nor low
PATH = 0.50  # metres, half the width of the trodden path
NEAR, MIDDLE, FAR = 8.5, 24.0, 70.0  # metres from the origin: rings of ever larger stands
SIZES = (0.5, 1.4, 3.0)  # metres across stands
KINDS = (4, 2, 1)  # stands of each tint
BLADES = (115, 520, 1500)  # of a stand
REACH = 26.0  # metres from the origin to the last single ears


@dataclass(frozen=True)
class Sward:
    """Rasters of the grass. stands: share that is upright, 0 to 1. tall: relative height. tints: share of each
    of TINTS, 1 in all."""

    stands: Float[Array, "n n"]
    tall: Float[Array, "n n"]
    tints: list[Float[Array, "n n"]]


def make_land(seed: int, exemplar: float) -> Land:
    """The field of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x6A55])
    sward = _draw_sward(rng)
    albedo = _draw_albedo(rng, sward)
    large = UNDULATION * noise.make_noise(rng, CELLS, PERIOD, longest=8.0, shortest=2.0, slope=1.8)
    small = 0.014 * noise.make_noise(rng, 1024, PERIOD, longest=0.9, shortest=0.12, slope=1.0)
    relief = land.make_relief(FadingRaster(large, 16.0, 50.0), FadingRaster(small, 7.0, 9.0), HILLS)
    height = land.level_ground(relief, exemplar)
    kinds, places = land.place_plants(rng, _plant_groups(rng, sward), height)
    return Land(land.make_ground_mesh(height), albedo, PERIOD, None, kinds, places, LIGHT)


def _draw_sward(rng) -> Sward:
    trodden = _draw_path(rng)
    lies = np.maximum(trodden, land.make_patches(rng, 0.07, 2.4))
    tall = np.clip(1.0 + 0.22 * noise.make_noise(rng, CELLS, PERIOD, 3.5, 0.5, 0.9), 0.55, 1.5)
    ripe = land.make_patches(rng, 0.24, 4.5)
    blue = land.make_patches(rng, 0.22, 3.0) * (1 - ripe)
    lush = land.make_patches(rng, 0.45, 5.0) * (1 - ripe - blue)
    tints = [lush, 1 - ripe - blue - lush, blue, ripe]
    return Sward(1 - lies, tall, tints)


def _draw_path(rng) -> Float[Array, "n n"]:
    """1 on a winding path through the exemplar, 0 off it.

    It is a contour of smooth noise, f = c: the distance to it is about |f - c| / |grad f|, and c is f at a place in the
    exemplar.
    """
    f = noise.make_noise(rng, CELLS, PERIOD, 16.0, 5.0, 2.0)
    slope = np.hypot(*(np.roll(f, -1, axis) - np.roll(f, 1, axis) for axis in (0, 1))) / (2 * PERIOD / CELLS)
    x, y = rng.uniform(-1.5, 1.5, (2, 1))
    away = np.abs(f - noise.sample_raster(f, PERIOD, x, y)) / np.maximum(slope, 0.15)
    ragged = 1.0 + 0.25 * noise.make_noise(rng, CELLS, PERIOD, 1.2, 0.2, 0.8)
    return 1 - smoothstep(0.75 * PATH, 1.25 * PATH, away * ragged)


def _draw_albedo(rng, sward: Sward) -> Float32[Array, "n n 3"]:
    """The ground's own colour: dead grass in fibres and some soil, tinted as the grass that stands on it."""
    n = TEXELS
    x, y = noise.texel_centres(n, PERIOD)
    stands, *shares = (noise.sample_raster(m, PERIOD, x, y)[..., None] for m in (sward.stands, *sward.tints))
    fibre = noise.make_noise(rng, n, PERIOD, 0.12, 0.016, 0.3)[..., None]
    mottle = noise.make_noise(rng, n, PERIOD, 1.0, 0.10, 0.7)[..., None]
    grass = sum(share * seen for share, seen in zip(shares, FROM_AFAR, strict=True))
    colour = THATCH + np.clip(0.85 * stands + 0.16 * fibre, 0, 1) * (grass - THATCH)
    bare = np.clip(0.12 + 0.2 * mottle - 0.1 * stands, 0, 0.8)
    shade = np.exp(0.12 * mottle + 0.14 * fibre)
    return np.clip((colour * (1 - bare) + SOIL * bare) * shade, 0.015, 0.8).astype(np.float32)


def _plant_groups(rng, sward: Sward) -> Iterator[PlantGroup]:
    yield from _ring_groups(rng, sward)
    where = sward.stands * land.make_patches(rng, 0.6, 3.5)
    rows = land.scatter_plants(rng, where, 380.0, (0.48, 0.80), (0.7 * REACH, REACH))
    rows[:, 2] *= np.clip(land.interpolate(sward.tall)(*rows[:, :2].T), 0.8, 1.15)
    yield PlantGroup([plants.make_seed_grass(rng) for _ in range(8)], rows)


def _ring_groups(rng, sward: Sward) -> Iterator[PlantGroup]:
    """Grass in three rings without gaps: at every place it is trodden or upright, and has one of the tints.

    The height falls to the end of the last ring, so that there is no edge.
    """
    rings = zip((0.0, NEAR, MIDDLE), (NEAR, MIDDLE, FAR), SIZES, KINDS, BLADES, strict=True)
    for inner, outer, size, kinds, count in rings:
        rows = land.lay_mats(rng, lambda x, y: np.ones_like(x), (inner, outer), size, overlap=0.2)
        x, y = rows[:, :2].T
        shares = np.cumsum([land.interpolate(sward.stands * share)(x, y) for share in sward.tints], axis=0)
        kind = (rng.uniform(size=len(rows)) > shares).sum(axis=0)
        rows[:, 2] *= 1 - 0.8 * smoothstep(0.55 * FAR, FAR, np.hypot(x, y))
        upright = kind < len(shares)
        rows[upright, 2] *= (0.45 + 0.55 * land.interpolate(sward.tall)(x, y))[upright]
        width = (0.0050 + 0.0015 * size) / size
        length = GRASS / size
        stands = [[plants.make_stand(rng, count, length, width, t) for _ in range(kinds)] for t in TINTS]
        stands.append([plants.make_mat(rng, round(1.5 * count), 0.3 * length, 0.5) for _ in range(kinds)])
        for k, meshes in enumerate(stands):
            yield PlantGroup(meshes, rows[kind == k])
