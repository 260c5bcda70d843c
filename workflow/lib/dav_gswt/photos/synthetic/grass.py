"""The grass family: tall wild grass in stands, tussocks and ears, with trodden paths where it lies flat, from one seed.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import grass_plants, land, noise, scattering
from dav_gswt.photos.synthetic.grass_plants import FRESH, STRAW, TINTS, Tint
from dav_gswt.photos.synthetic.land import FamilyOptions, Land, Light, option, smoothstep
from dav_gswt.photos.synthetic.scattering import CELLS, PERIOD, PlantGroup

TEXELS = 2048  # a side of the period: 7.8 mm a texel
SOIL = np.array([0.15, 0.112, 0.07])
THATCH = np.array([0.36, 0.305, 0.155])  # dead grass on the ground
FROM_AFAR = [0.85 * (t.green.mean(axis=0) * (1 - t.dry) + STRAW.mean(axis=0) * t.dry) for t in TINTS]
SUN = np.array([5.9, 5.05, 3.8])  # irradiance across the beam; like the sky's radiance in units of the exposure
ZENITH = np.array([0.20, 0.31, 0.53])
HORIZON = np.array([0.70, 0.69, 0.64])
NEAR, MIDDLE, FAR = 8.5, 24.0, 70.0  # metres from the origin: rings of ever larger stands
HILLS = ((0.037, -0.021, 2.1, 1.0), (0.023, 0.043, 0.0, 1.0), (0.0, 0.055, 0.3, 0.7))
SIZES = (0.5, 1.4, 3.0)  # metres across stands
KINDS = (4, 2, 1)  # stands of each tint
BLADES = (115, 520, 1500)  # of a stand
TRODDEN = (Tint(FRESH, 0.45), Tint(STRAW, 0.5), Tint(FRESH, 0.6))
REACH = 26.0  # metres from the origin to the last single tussocks and ears


@dataclass(frozen=True)
class Options(FamilyOptions):
    """What a field of tall grass may vary in: default, least and greatest value."""

    undulation: float = option(0.14, 0.0, 0.5)  # metres, standard deviation of the rolling of the ground
    grass: float = option(0.46, 0.2, 0.8)  # metres, length of the grass where it is neither high nor low
    swirl: float = option(0.9, 0.0, 3.0)  # radians, standard deviation of the way the grass leans
    path: float = option(0.50, 0.0, 1.0)  # metres, half the width of a trodden path
    lain: float = option(0.07, 0.0, 0.6)  # share of the ground where grass lies flat besides paths
    straw: float = option(0.24, 0.0, 0.6)  # share of the ground where grass is ripe
    tussocks: float = option(55.0, 0.0, 300.0)  # on 100 square metres
    ears: float = option(330.0, 0.0, 1200.0)  # plants in ear, on 100 square metres
    docks: float = option(5.0, 0.0, 100.0)  # on 100 square metres
    sun_elevation: float = option(40.0, 10.0, 85.0)  # degrees
    sun_azimuth: float = option(150.0, -360.0, 360.0)  # degrees from +x, where the sun stands


@dataclass(frozen=True)
class Sward:
    """Rasters of the grass. stands: share that is upright, 0 to 1. tall: relative height. lean: direction of the lean,
    x and y of a unit vector. tints: share of each of TINTS, 1 in all."""

    stands: Float[Array, "n n"]
    tall: Float[Array, "n n"]
    lean: tuple[Float[Array, "n n"], Float[Array, "n n"]]
    tints: list[Float[Array, "n n"]]


def make_land(o: Options, seed: int, exemplar: float) -> Land:
    """The field of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x6A55])
    sward = _draw_sward(rng, o)
    albedo = _albedo(rng, sward)
    large = o.undulation * noise.make_noise(rng, CELLS, PERIOD, longest=8.0, shortest=2.0, slope=1.8)
    small = 0.014 * noise.make_noise(rng, 1024, PERIOD, longest=0.9, shortest=0.12, slope=1.0)
    height = land.level_ground(lambda x, y: _height(x, y, large, small, o), exemplar)
    plants, places = scattering.place_plants(rng, _plant_groups(rng, o, sward), height)
    light = Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.3 * np.mean(FROM_AFAR, axis=0))
    return Land(land.make_ground_mesh(height), albedo, PERIOD, None, plants, places, light)


def _draw_sward(rng, o: Options) -> Sward:
    trodden = _draw_path(rng, o.path)
    lies = np.maximum(trodden, scattering.make_patches(rng, o.lain, 2.4) if o.lain else 0.0)
    tall = noise.make_noise(rng, CELLS, PERIOD, 3.5, 0.5, 0.9)
    tall = np.clip(1.0 + 0.22 * tall, 0.55, 1.5)
    turn = np.radians(35.0) + o.swirl * noise.make_noise(rng, CELLS, PERIOD, 7.0, 2.0, 1.2)
    ripe = scattering.make_patches(rng, o.straw, 4.5) if o.straw else np.zeros((CELLS, CELLS))
    blue = scattering.make_patches(rng, 0.22, 3.0) * (1 - ripe)
    lush = scattering.make_patches(rng, 0.45, 5.0) * (1 - ripe - blue)
    tints = [lush, 1 - ripe - blue - lush, blue, ripe]
    return Sward(1 - lies, tall, (np.cos(turn), np.sin(turn)), tints)


def _draw_path(rng, half: float) -> Float[Array, "n n"]:
    """1 on a winding path through the exemplar, 0 off it.

    It is a contour of smooth noise, f = c: the distance to it is about |f - c| / |grad f|, and c is f at a place in the
    exemplar.
    """
    f = noise.make_noise(rng, CELLS, PERIOD, 16.0, 5.0, 2.0)
    cell = PERIOD / CELLS
    slope = np.hypot(*(np.roll(f, -1, axis) - np.roll(f, 1, axis) for axis in (0, 1))) / (2 * cell)
    x, y = rng.uniform(-1.5, 1.5, (2, 1))
    away = np.abs(f - noise.sample_raster(f, PERIOD, x, y)) / np.maximum(slope, 0.15)
    ragged = 1.0 + 0.25 * noise.make_noise(rng, CELLS, PERIOD, 1.2, 0.2, 0.8)
    return 1 - smoothstep(0.75 * half, 1.25 * half, away * ragged) if half else np.zeros((CELLS, CELLS))


def _albedo(rng, sward: Sward) -> Float32[Array, "n n 3"]:
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


def _height(x, y, large, small, o: Options):
    """Ground height before levelling: rolling, hummocks near the middle, and far hills."""
    z = land.fade_raster(large, PERIOD, x, y, 16.0, 50.0) + land.fade_raster(small, PERIOD, x, y, 7.0, 9.0)
    return z + land.sum_hills(x, y, (14.0, 130.0), (o.undulation, 13.0), HILLS)


def _plant_groups(rng, o: Options, sward: Sward) -> Iterator[PlantGroup]:
    thinning = 0.7 * REACH, REACH
    yield from _ring_groups(rng, o, sward)
    for share, tint in zip(sward.tints, TINTS, strict=True):
        where = sward.stands * share * scattering.make_patches(rng, 0.6, 2.5)
        rows = scattering.scatter_plants(rng, where, o.tussocks * share.mean(), (0.38, 0.72), thinning)
        yield PlantGroup([grass_plants.make_tussock(rng, tint) for _ in range(3)], rows)
    for make_ear in grass_plants.EARS:
        where = sward.stands * scattering.make_patches(rng, 0.45, 3.5)
        rows = scattering.scatter_plants(rng, where, o.ears / len(grass_plants.EARS), (0.48, 0.80), thinning)
        rows[:, 2] *= np.clip(scattering.interpolate(sward.tall)(*rows[:, :2].T), 0.8, 1.15) * o.grass / 0.46
        yield PlantGroup([make_ear(rng) for _ in range(5)], rows)
    where = sward.stands * scattering.make_patches(rng, 0.2, 3.0)
    rows = scattering.scatter_plants(rng, where, o.docks, (0.55, 0.85), thinning)
    yield PlantGroup([grass_plants.make_dock(rng) for _ in range(3)], rows)


def _ring_groups(rng, o: Options, sward: Sward) -> Iterator[PlantGroup]:
    """Grass in three rings without gaps: at every place it is trodden or upright, and has one of the tints.

    The height falls to the end of the last ring, so that there is no edge.
    """
    rings = zip((0.0, NEAR, MIDDLE), (NEAR, MIDDLE, FAR), SIZES, KINDS, BLADES, strict=True)
    for inner, outer, size, kinds, count in rings:
        rows = scattering.lay_mats(rng, lambda x, y: np.ones_like(x), (inner, outer), size, overlap=0.2)
        x, y = rows[:, :2].T
        shares = np.cumsum([scattering.interpolate(sward.stands * share)(x, y) for share in sward.tints], axis=0)
        kind = (rng.uniform(size=len(rows)) > shares).sum(axis=0)
        rows[:, 2] *= 1 - 0.8 * smoothstep(0.55 * FAR, FAR, np.hypot(x, y))
        upright = kind < len(shares)
        rows[upright, 2] *= (0.45 + 0.55 * scattering.interpolate(sward.tall)(x, y))[upright]
        width = (0.0050 + 0.0015 * size) / size
        length, flat = o.grass / size, 0.7 * o.grass / size
        stands = [[grass_plants.make_stand(rng, count, length, width, t) for _ in range(kinds)] for t in TINTS]
        stands.append([grass_plants.make_flat_grass(rng, round(1.5 * count), flat, width, t) for t in TRODDEN])
        for k, meshes in enumerate(stands):
            yield PlantGroup(meshes, rows[kind == k], _draw_yaw(rng, sward, rows[kind == k]))


def _draw_yaw(rng, sward: Sward, rows: Float[Array, "n 4"]) -> Float[Array, "n"]:
    """The direction in which grass leans, radians."""
    x, y = (scattering.interpolate(part)(*rows[:, :2].T) for part in sward.lean)
    return np.arctan2(y, x) + rng.normal(0, 0.35, len(rows))
