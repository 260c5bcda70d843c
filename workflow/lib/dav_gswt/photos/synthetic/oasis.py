"""The oasis family: sand, a patch of meadow, a boulder field, a path, single shrubs and boulders, all from one seed.

It is ground of several materials with objects on it, and knows its true labels (`labels`). Objects are shrubs, and
boulders that stand apart from the boulder field; stones of the field, small stones, grass and flowers belong to their
material.

Metres, z up; the mean ground over the exemplar square about the origin is at z = 0.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy import ndimage

from dav_gswt.photos.synthetic import (
    desert,
    land,
    meadow,
    meadow_plants,
    meshes,
    noise,
    oasis_layout,
    rocks,
    scattering,
)
from dav_gswt.photos.synthetic.labels import GroundLabels, LandObject
from dav_gswt.photos.synthetic.land import FamilyOptions, Height, Land, Light, option, smoothstep
from dav_gswt.photos.synthetic.meshes import Mesh
from dav_gswt.photos.synthetic.oasis_layout import Layout
from dav_gswt.photos.synthetic.scattering import PERIOD, PlantGroup

FieldStones = tuple[Float[Array, "a 3"], Float[Array, "b 3"], Float[Array, "c 3"]]
TEXELS = 2048  # a side of the period: 7.8 mm a texel
GRIT = np.array([0.235, 0.20, 0.165])  # between the stones of the boulder field
PACKED = np.array([0.315, 0.232, 0.158])  # trodden earth
ROCK = (
    np.array([[0.30, 0.27, 0.235], [0.22, 0.20, 0.18], [0.39, 0.345, 0.285], [0.27, 0.215, 0.165]]),
    0.75 * desert.SAND,
)
SAGE = np.array([[0.30, 0.325, 0.20], [0.25, 0.285, 0.15], [0.35, 0.36, 0.25]])  # leaves of the greener shrubs
SUN = np.array([5.0, 4.45, 3.55])  # irradiance across the beam; like the sky's radiance in units of the exposure
ZENITH = np.array([0.19, 0.32, 0.57])
HORIZON = np.array([0.52, 0.60, 0.68])
HILLS = ((0.053, 0.037, 0.7, 1.0), (0.027, -0.061, 0.0, 1.0), (0.0, 0.08, 1.1, 0.7))
NEAR, FAR = 8.5, 20.0  # metres from the origin: small mats of short grass to NEAR, large mats to FAR
MAT, WIDE = 0.30, 1.2  # metres across small and large mats
BLADES = 265  # of a small mat
FLOWERING = (0.30, 0.38, 0.14, 0.18)  # share of each kind of meadow_plants.FLOWERS
SHRUBS = 7  # kinds
SHRUB_RADII, BOULDER_RADII = (0.18, 0.29), (0.13, 0.22)  # metres, of objects from above
FIELD, LITTLE = (0.06, 0.34, 2.3), (0.010, 0.06, 2.6)  # stones and pebbles: size as of `rocks.draw_sizes`
BIG = 0.15  # metres: larger stones that are no objects lie within a boulder field, not at its border


@dataclass(frozen=True)
class Options(FamilyOptions):
    """What an oasis may vary in: default, least and greatest value."""

    undulation: float = option(0.09, 0.0, 0.4)  # metres, standard deviation of the rolling of the ground
    ripple_length: float = option(0.21, 0.10, 0.6)  # metres from crest to crest
    ripple_height: float = option(0.019, 0.0, 0.08)  # metres from trough to crest where ripples are strongest
    wind: float = option(62.0, -360.0, 360.0)  # degrees from +x, where the wind blows to
    meadow: float = option(0.33, 0.1, 0.5)  # share of the exemplar
    boulders: float = option(0.165, 0.05, 0.3)  # share of the exemplar that is boulder field
    path: float = option(0.20, 0.0, 0.5)  # metres, half the width of the path
    grass: float = option(0.066, 0.02, 0.12)  # metres, length of the short grass
    flowers: float = option(340.0, 0.0, 1000.0)  # plants on 100 square metres of meadow
    shrubs: float = option(30.0, 0.0, 42.0)  # on 100 square metres
    single_boulders: float = option(11.0, 0.0, 20.0)  # on 100 square metres
    stones: float = option(5500.0, 0.0, 9000.0)  # of 6 to 34 cm, at most, on 100 square metres of boulder field
    pebbles: float = option(7000.0, 0.0, 20000.0)  # of 1 to 6 cm on 100 square metres of boulder field; a fifth on sand
    sun_elevation: float = option(43.0, 10.0, 85.0)  # degrees
    sun_azimuth: float = option(128.0, -360.0, 360.0)  # degrees from +x, where the sun stands


def make_land(o: Options, seed: int, exemplar: float) -> Land:
    """The oasis of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x0A51])
    layout = oasis_layout.draw_layout(rng, TEXELS, exemplar, (o.meadow, o.boulders), o.path)
    albedo, small = _draw_ground(rng, layout, o)
    large = o.undulation * noise.make_noise(rng, 512, PERIOD, longest=7.5, shortest=2.0, slope=1.8)
    shrubs = _scatter_objects(rng, layout, np.zeros((0, 3)), o.shrubs, SHRUB_RADII, exemplar)
    singles = _scatter_objects(rng, layout, shrubs, o.single_boulders, BOULDER_RADII, exemplar)
    height = land.level_ground(lambda x, y: _height(x, y, large, small, shrubs, o), exemplar)
    around = oasis_layout.cover_circles(TEXELS, np.vstack([shrubs * [1, 1, 0.8], singles]))
    field = _scatter_field(rng, layout, 1 - around, o)
    shaded = np.vstack([shrubs * [1, 1, 0.8], singles * [1, 1, 0.75], field[0] * [1, 1, 0.45]])
    groups = _plant_groups(rng, layout, 1 - oasis_layout.cover_circles(TEXELS, shaded), o)
    plants, places = scattering.place_plants(rng, groups, height)
    bushes = [_make_bush(rng, k) for k in range(SHRUBS)]
    standing = _place_shrubs(rng, bushes, shrubs, height, len(plants))
    blocks = [_lay_boulder(rng, single, height) for single in singles]
    loose = _lay_pebbles(rng, layout, 1 - around, o, height) + _lay_field(rng, field, height)
    things = [LandObject("shrub", _stand(bushes[int(row[0]) - len(plants)], row)) for row in standing]
    things += [LandObject("boulder", _cut_off(block, height)) for block in blocks]
    shrub_kinds = frozenset(range(len(plants), len(plants) + SHRUBS))
    return Land(
        ground=land.make_ground_mesh(height),
        albedo=albedo,
        period=PERIOD,
        stones=meshes.merge_meshes(blocks + loose) if blocks + loose else None,
        plants=plants + bushes,
        places=np.concatenate([places, standing]),
        light=Light(o.sun_elevation, o.sun_azimuth, SUN, ZENITH, HORIZON, 0.4 * desert.SAND),
        labels=GroundLabels(oasis_layout.MATERIALS, layout.material, PERIOD, tuple(things), shrub_kinds),
    )


def _draw_ground(rng, layout: Layout, o: Options) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The ground's colour and its small heights: sand, turf, grit and trodden earth, mixed in grains at borders."""
    n = TEXELS
    winds = desert.Options(ripple_length=o.ripple_length, ripple_height=o.ripple_height, wind=o.wind)
    colour, sand = desert.draw_sand(rng, winds, n, gravel=0.0)
    colour = 0.80 * colour
    lush = 0.6 * smoothstep(-1.3, 1.5, noise.make_noise(rng, n, PERIOD, 4.0, 0.7, 1.2)) * layout.meadow
    sward = meadow.draw_sward(rng, 0.5 + 0.5 * layout.meadow, lush, n)
    grain = noise.make_noise(rng, n, PERIOD, 0.06, 0.012, 0.5)
    clods = noise.make_noise(rng, n, PERIOD, 0.35, 0.03, 0.9)
    mottle = noise.make_noise(rng, n, PERIOD, 1.1, 0.10, 0.8)
    grit = GRIT * np.exp(0.30 * grain + 0.16 * clods + 0.10 * mottle)[..., None]
    packed = PACKED * np.exp(0.07 * grain + 0.07 * clods + 0.07 * mottle)[..., None]
    ragged = 0.16 * grain + 0.14 * clods
    turf = smoothstep(0.15, 1.0, layout.meadow * (1 - layout.path) ** 2)  # blades reach over its border
    for what, where in ((grit, layout.boulders), (sward, turf), (packed, layout.path)):
        share = smoothstep(0.25, 0.75, where + ragged * (where > 0.01))[..., None]
        colour = colour + share * (what - colour)
    loose = (1 - 0.85 * layout.path) * (1 - layout.meadow) * (1 - layout.boulders)
    hummocks = 0.010 * noise.make_noise(rng, n, PERIOD, 0.9, 0.10, 1.0)
    heights = sand * loose + layout.meadow * (hummocks + 0.022) + layout.boulders * (0.008 * clods + 0.012)
    heights = heights * (1 - layout.path) - layout.path * (0.020 - 0.0025 * clods)
    return np.clip(colour, 0.015, 0.9).astype(np.float32), heights


def _height(x, y, large, small, shrubs, o: Options):
    """Ground height before levelling: undulation, small heights near the middle, far hills, and soil about shrubs."""
    z = land.fade_raster(large, PERIOD, x, y, 13.0, 34.0) + land.fade_raster(small, PERIOD, x, y, 7.0, 8.5)
    z = z + land.sum_hills(x, y, (14.0, 90.0), (o.undulation, 10.0), HILLS)
    return land.add_mounds(z, x, y, shrubs, height=0.16, width=1.1, end=6.0)


def _scatter_objects(rng, layout: Layout, taken, density: float, radii, exemplar: float) -> Float[Array, "n 3"]:
    """Objects of `density` on 100 square metres, in the exemplar and around it."""
    count = density * exemplar**2 / 100
    return oasis_layout.scatter_objects(rng, layout, taken, (count, 2 * count), radii, exemplar)


def _plant_groups(rng, layout: Layout, free: Float[Array, "n n"], o: Options) -> Iterator[PlantGroup]:
    """Short grass, which thins out at the border, tufts along it, clover and flowers within."""
    fade = 0.4 * FAR, FAR
    grassy, open_ = _coarsen(layout.meadow), _coarsen(free * (1 - layout.path) ** 2)
    cover = smoothstep(0.25, 0.80, grassy) * open_
    fringe = smoothstep(0.02, 0.45, grassy) * (1 - smoothstep(0.55, 0.98, grassy)) * open_
    density = scattering.interpolate(cover)
    near = [meadow_plants.make_mat(rng, BLADES, o.grass / MAT, dry) for dry in (0.08, 0.15, 0.35) for _ in range(3)]
    yield PlantGroup(near, scattering.lay_mats(rng, density, (0.0, NEAR), MAT, overlap=0.16, jitter=0.35))
    wide = [meadow_plants.make_mat(rng, 1300, 1.2 * o.grass / WIDE, 0.2) for _ in range(3)]
    yield PlantGroup(wide, scattering.lay_mats(rng, scattering.fade_out(density, *fade), (NEAR, FAR), WIDE, jitter=0.3))
    yield PlantGroup(
        [meadow_plants.make_tuft(rng) for _ in range(8)],
        np.vstack(
            [
                _scatter(rng, cover, 260.0, (0.07, 0.16), fade),
                _scatter(rng, fringe, 1400.0, (0.05, 0.13), fade),
            ]
        ),
    )
    yield PlantGroup([meshes.make_tuft(rng) for _ in range(5)], _scatter(rng, fringe, 500.0, (0.07, 0.18), fade))
    heads = [meadow_plants.make_seed_grass(rng) for _ in range(6)]
    yield PlantGroup(heads, _scatter(rng, cover, 90.0, (0.18, 0.32), fade))
    patches = scattering.make_patches(rng, 0.3, 2.0)
    clover = [meadow_plants.make_clover(rng) for _ in range(4)]
    yield PlantGroup(clover, _scatter(rng, cover * patches, 220.0, (0.06, 0.10), fade, lies=1.0))
    for kind, share in zip(meadow_plants.FLOWERS, FLOWERING, strict=True):
        where = cover * (0.15 + 0.85 * scattering.make_patches(rng, 0.35, 2.2))
        flowers = [meadow_plants.make_flower(rng, kind) for _ in range(4)]
        heights = 0.8 * kind.heights[0], 0.8 * kind.heights[1]
        yield PlantGroup(flowers, _scatter(rng, where, 2.2 * o.flowers * share, heights, fade))


def _coarsen(raster: Float[Array, "n n"]) -> Float[Array, "c c"]:
    """A raster of the ground's texels on the cells of `scattering`."""
    return noise.sample_raster(raster, PERIOD, *noise.texel_centres(scattering.CELLS, PERIOD))


def _scatter(rng, where, density: float, sizes, fade, lies: float = 0.0) -> Float[Array, "n 4"]:
    """Plants as of `scattering.scatter_plants`, but `density` on 100 square metres where `where` is 1."""
    return scattering.scatter_plants(rng, where, density * where.mean(), sizes, fade, lies)


def _make_bush(rng, kind: int) -> Mesh:
    """A shrub of a kind: every third is dry."""
    palette, leaves = (meshes.LEAF, (14, 22)) if kind % 3 == 0 else (SAGE, (24, 36))
    return meshes.make_shrub(rng, palette, leaves)


def _place_shrubs(rng, bushes: list[Mesh], shrubs, height: Height, first: int) -> Float[Array, "n 8"]:
    """Rows of Land.places of shrubs as wide as their circles. first: number of the first kind."""
    which = rng.integers(0, len(bushes), len(shrubs))
    reach = np.array([np.hypot(*bush.vertices[:, :2].T).max() for bush in bushes])
    x, y, radius = shrubs.T
    turn = rng.uniform(0, 2 * np.pi, len(x))
    return np.column_stack([first + which, x, y, height(x, y), radius / reach[which], turn, np.zeros((len(x), 2))])


def _stand(bush: Mesh, row: Float[Array, "8"]) -> Float32[Array, "v 3"]:
    return meshes.transform_mesh(bush, row[1:4], row[4], row[5]).vertices


def _lay_boulder(rng, single: Float[Array, "3"], height: Height) -> Mesh:
    """A boulder as wide as its circle, a third of it in the ground."""
    x, y, radius = single
    rock = rocks.make_rock(rng, 4, ROCK)
    size = radius / np.hypot(*rock.vertices[:, :2].T).max()
    low, high = rock.vertices[:, 2].min(), rock.vertices[:, 2].max()
    sunk = size * (low + rng.uniform(0.2, 0.4) * (high - low))
    up = height(np.array([x]), np.array([y]))[0] - sunk
    return meshes.transform_mesh(rock, (x, y, up), size, rng.uniform(0, 2 * np.pi))


def _cut_off(block: Mesh, height: Height) -> Float32[Array, "v 3"]:
    """The vertices above the ground."""
    x, y, z = block.vertices.T.astype(float)
    return block.vertices[z > height(x, y)]


def _scatter_field(rng, layout: Layout, free: Float[Array, "n n"], o: Options) -> FieldStones:
    """x, y and size of the stones of the boulder field: big ones, small ones, and, beyond STONE_SQUARE, big ones alone.

    BIG ones lie well within the field.
    """
    near = land.STONE_SQUARE / 2
    boulders, free = (_coarsen(raster) for raster in (layout.boulders, free))
    inner = ndimage.gaussian_filter(boulders, 0.2 * scattering.CELLS / PERIOD, mode="wrap")
    inner, whole = smoothstep(0.55, 0.9, inner) * free, smoothstep(0.3, 0.9, boulders) * free
    sizes = rocks.draw_sizes(rng, round(o.stones * land.STONE_SQUARE**2 / 100), *FIELD)
    big, small = sizes[sizes > BIG], sizes[sizes <= BIG]
    lying = oasis_layout.scatter_touching(rng, big, inner, (near, 0.0), np.zeros((0, 3)))
    between = oasis_layout.scatter_touching(rng, small, whole, (near, 0.0), lying)
    beyond = oasis_layout.scatter_touching(rng, np.tile(big, 3), inner, (2 * near, near), lying)  # of 3 times the area
    return lying, between, beyond


def _lay_field(rng, field: FieldStones, height: Height) -> list[Mesh]:
    """The stones of `_scatter_field`, in ever coarser meshes."""
    found = []
    for rows, kinds, fine in zip(field, (12, 16, 8), (3, 2, 1), strict=True):
        found += _lay(rng, rows, [rocks.make_rock(rng, fine, ROCK) for _ in range(kinds)], height)
    return found


def _lay_pebbles(rng, layout: Layout, free: Float[Array, "n n"], o: Options, height: Height) -> list[Mesh]:
    """Little stones, most of them in the boulder field and along the path."""
    verge = 4 * layout.path * (1 - layout.path)
    share = (0.18 * (1 - layout.meadow) + layout.boulders + 0.2 * verge) * free * (1 - 0.9 * layout.path)
    most = 0.01 * o.pebbles
    places = land.scatter_points(
        rng, lambda x, y: most * noise.sample_raster(share, PERIOD, x, y), most * share.max(), land.STONE_SQUARE / 2
    )
    sizes = rocks.draw_sizes(rng, len(places), *LITTLE)
    return _lay(rng, np.column_stack([places, sizes]), [meshes.make_stone(rng, 1, ROCK) for _ in range(24)], height)


def _lay(rng, places: Float[Array, "n 3"], kinds: list[Mesh], height: Height) -> list[Mesh]:
    """Stones at x and y, of a size, half sunk into the ground."""
    z = height(places[:, 0], places[:, 1]) + places[:, 2] * rng.uniform(-0.08, 0.16, len(places))
    return [
        meshes.transform_mesh(kinds[rng.integers(len(kinds))], (x, y, up), size, rng.uniform(0, 2 * np.pi))
        for (x, y, size), up in zip(places, z, strict=True)
    ]
