"""The oasis family: sand, a patch of meadow, a boulder field, a path, single shrubs and boulders.

The ground has several materials with objects on it, and its true labels are known (`labels`). Objects are shrubs, and
boulders that stand apart from the boulder field; stones of the field, small stones, grass and flowers belong to their
material. The exemplar has one large patch of meadow and one boulder field, on opposite sides of a path that winds
through it; beyond it, noise alone decides.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array
from scipy import ndimage

from dav_gswt.photos.synthetic import desert, land, meadow, meshes, noise, plants
from dav_gswt.photos.synthetic.land import PERIOD, FadingRaster, GroundLabels, Height, Hills, Land, Light, PlantGroup
from dav_gswt.photos.synthetic.meshes import Mesh
from dav_gswt.photos.synthetic.noise import smoothstep

SAND, MEADOW, BOULDERS, PATH = range(1, 5)
MATERIALS = {"sand": SAND, "meadow": MEADOW, "boulders": BOULDERS, "path": PATH}
SHARES = (0.33, 0.165)  # of the exemplar that are meadow and boulder field
HALF_PATH = 0.20  # metres, half the width of the path
WAVES = 7  # of the winding path, over a period
SOFT = 0.11  # half the range of a potential over which a material thins out
WINDING = 0.55  # metres, standard deviation of the path from a straight line
CLEAR = 0.08  # metres between an object and a path, a boulder field or the exemplar's edge
TOUCH = 0.86  # least distance of two stones of a field, in mean sizes
APART = 0.55  # metres between the edges of two objects
TEXELS = 2048  # a side of the period: 7.8 mm a texel
GRIT = np.array([0.235, 0.20, 0.165])  # between the stones of the boulder field
PACKED = np.array([0.315, 0.232, 0.158])  # trodden earth
ROCK = (
    np.array([[0.30, 0.27, 0.235], [0.22, 0.20, 0.18], [0.39, 0.345, 0.285], [0.27, 0.215, 0.165]]),
    0.75 * desert.SAND,
)
SAGE = np.array([[0.30, 0.325, 0.20], [0.25, 0.285, 0.15], [0.35, 0.36, 0.25]])  # leaves of the greener shrubs
LIGHT = Light(43.0, 128.0, (5.0, 4.45, 3.55), (0.19, 0.32, 0.57), (0.52, 0.60, 0.68), 0.4 * desert.SAND)
UNDULATION = 0.09  # metres, standard deviation
HILLS = Hills(
    (14.0, 90.0), (UNDULATION, 10.0), ((0.053, 0.037, 0.7, 1.0), (0.027, -0.061, 0.0, 1.0), (0.0, 0.08, 1.1, 0.7))
)
NEAR, FAR = 8.5, 20.0  # metres from the origin: small mats of short grass to NEAR, large mats to FAR
MAT, WIDE = 0.30, 1.2  # metres across small and large mats
GRASS = 0.066  # metres, length of the short grass
FLOWERING = (0.30, 0.38, 0.14, 0.18)  # share of each of MEADOW_FLOWERS
KINDS = 7  # of shrubs
SHRUBS, SINGLES = 30.0, 11.0  # shrubs and single boulders on 100 square metres
SHRUB_RADII, BOULDER_RADII = (0.18, 0.29), (0.13, 0.22)  # metres, of objects from above
STONES, PEBBLES = 5500.0, 7000.0  # at most, on 100 square metres of boulder field
FIELD, LITTLE = (0.06, 0.34, 2.3), (0.010, 0.06, 2.6)  # stones and pebbles: size as of `meshes.draw_sizes`
BIG = 0.15  # metres: larger stones that are no objects lie within a boulder field, not at its border


@dataclass(frozen=True)
class Layout:
    """Rasters. meadow, boulders, path: 0 (none) to 1 (all), soft at borders. material: numbers of MATERIALS."""

    meadow: Float[Array, "n n"]
    boulders: Float[Array, "n n"]
    path: Float[Array, "n n"]
    material: Int[Array, "n n"]


def make_land(seed: int, exemplar: float) -> Land:
    """The oasis of a seed. exemplar: side of the square about the origin whose mean height becomes 0."""
    rng = np.random.default_rng([seed, 0x0A51])
    layout = draw_layout(rng, TEXELS, exemplar)
    albedo, small = _draw_ground(rng, layout)
    large = UNDULATION * noise.make_noise(rng, 512, PERIOD, longest=7.5, shortest=2.0, slope=1.8)
    shrubs = _scatter_objects(rng, layout, np.zeros((0, 3)), SHRUBS, SHRUB_RADII, exemplar)
    singles = _scatter_objects(rng, layout, shrubs, SINGLES, BOULDER_RADII, exemplar)
    relief = land.make_relief(FadingRaster(large, 13.0, 34.0), FadingRaster(small, 7.0, 8.5), HILLS)
    height = land.level_ground(
        lambda x, y: land.add_mounds(relief(x, y), x, y, shrubs, height=0.16, width=1.1, end=6.0), exemplar
    )
    free = 1 - _cover_circles(TEXELS, np.vstack([shrubs * [1, 1, 0.8], singles]))
    field = _scatter_field(rng, layout, free)
    shaded = np.vstack([shrubs * [1, 1, 0.8], singles * [1, 1, 0.75], field[0] * [1, 1, 0.45]])
    groups = _plant_groups(rng, layout, 1 - _cover_circles(TEXELS, shaded))
    kinds, places = land.place_plants(rng, groups, height)
    # every third kind of shrub is dry
    leaves = [(SAGE, (24, 36)) if k % 3 else (plants.DRY_LEAF, (14, 22)) for k in range(KINDS)]
    bushes = [plants.make_shrub(rng, *leaf) for leaf in leaves]
    which = rng.integers(0, len(bushes), len(shrubs))
    reach = np.array([np.hypot(*bush.vertices[:, :2].T).max() for bush in bushes])
    x, y, radius = shrubs.T
    standing = land.stand_upright(rng, len(kinds) + which, x, y, height(x, y), radius / reach[which])
    blocks = [_lay_boulder(rng, single, height) for single in singles]
    loose = _lay_pebbles(rng, layout, free, height) + _lay_field(rng, field, height)
    things = [
        meshes.transform_mesh(bushes[k], row[1:4], row[4], row[5]).vertices
        for k, row in zip(which, standing, strict=True)
    ]
    for block in blocks:
        x, y, z = block.vertices.T.astype(float)
        things.append(block.vertices[z > height(x, y)])  # what is above the ground
    return Land(
        ground=land.make_ground_mesh(height),
        albedo=albedo,
        period=PERIOD,
        stones=meshes.merge_meshes(blocks + loose),
        plants=kinds + bushes,
        places=np.concatenate([places, standing]),
        light=LIGHT,
        labels=GroundLabels(MATERIALS, layout.material, PERIOD, tuple(things)),
    )


def draw_layout(rng: np.random.Generator, n: int, exemplar: float) -> Layout:
    """The layout on n x n texels. exemplar: side of the square about the origin."""
    x, y = ((at + PERIOD / 2) % PERIOD - PERIOD / 2 for at in noise.texel_centres(n, PERIOD))
    inside = np.maximum(np.abs(x), np.abs(y)) <= exemplar / 2
    one, other = rng.choice([-1.0, 1.0], 2)
    # along and across the path: x and y, mirrored or exchanged at random
    u, v = (one * y, other * x) if rng.uniform() < 0.5 else (one * x, other * y)

    def bump(at_u: float, at_v: float, width: float) -> Float[Array, "n n"]:
        """A Gaussian hill of height 1 about a place that varies a little."""
        du, dv = rng.uniform(-0.3, 0.3, 2)
        return np.exp(-((u - at_u - du) ** 2 + (v - at_v - dv) ** 2) / (2 * width**2))

    away = _path_distance(rng, u, v) * (1 + 0.22 * noise.make_noise(rng, n, PERIOD, 0.9, 0.12, 0.8))
    path = 1 - smoothstep(0.75 * HALF_PATH, 1.25 * HALF_PATH, away)
    near = np.exp(-((away / (HALF_PATH + 0.35)) ** 2))

    beyond = smoothstep(0.5 * exemplar, 0.5 * exemplar + 1.5, np.maximum(np.abs(x), np.abs(y)))
    meadow = bump(-1.2, 1.25, 1.8) + (0.20 + 0.35 * beyond) * noise.make_noise(rng, n, PERIOD, 4.0, 0.11, 1.7)
    meadow -= _find_level(meadow, inside & (path < 0.5), SHARES[0] * inside.sum())
    boulders = bump(1.55, -1.75, 1.3) + (0.16 + 0.25 * beyond) * noise.make_noise(rng, n, PERIOD, 4.0, 0.11, 1.7)
    boulders -= near + smoothstep(-0.2, 0.1, meadow)
    boulders -= _find_level(boulders, inside, SHARES[1] * inside.sum())

    material = np.full((n, n), SAND)
    for number, where in ((MEADOW, meadow > 0), (BOULDERS, boulders > 0), (PATH, path > 0.5)):
        material[where] = number
    soft = [smoothstep(-SOFT, SOFT, potential) for potential in (meadow, boulders)]
    return Layout(soft[0] * (1 - soft[1]), soft[1], path, material)


def _path_distance(rng, u: Float[Array, "n n"], v: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The distance to the middle of the path, v = c(u) with c a sum of sines: about |v - c| / sqrt(1 + c'^2)."""
    k = 2 * np.pi / PERIOD * np.arange(1, WAVES + 1)
    size = rng.uniform(0.6, 1.4, WAVES) * np.array([0.5, 0.9, 1.0, 0.6, 0.4, 0.2, 0.15])
    size *= WINDING / np.sqrt((size**2).sum() / 2)
    phase = rng.uniform(0, 2 * np.pi, WAVES)
    along = np.unique(u)
    middle = (size * np.sin(np.outer(along, k) + phase)).sum(axis=1)
    slope = (k * size * np.cos(np.outer(along, k) + phase)).sum(axis=1)
    middle += rng.uniform(-0.25, 0.25) - middle[np.abs(along) < 3].mean()
    column = np.searchsorted(along, u)
    across = np.abs((v - middle[column] + PERIOD / 2) % PERIOD - PERIOD / 2)
    return across / np.sqrt(1 + slope[column] ** 2)


def _find_level(raster: Float[Array, "n n"], where: Array, count: float) -> float:
    """The value that `count` texels of `where` exceed."""
    values = raster[where]
    return float(np.quantile(values, np.clip(1 - count / len(values), 0, 1)))


def _draw_ground(rng, layout: Layout) -> tuple[Float32[Array, "n n 3"], Float[Array, "n n"]]:
    """The ground's colour and its small heights: sand, turf, grit and trodden earth, mixed in grains at borders."""
    n = TEXELS
    colour, sand = desert.draw_sand(rng, n, 0.21, 0.019, 62.0, gravel=0.0)
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


def _scatter_objects(
    rng, layout: Layout, taken: Float[Array, "k 3"], density: float, radii: tuple[float, float], exemplar: float
) -> Float[Array, "n 3"]:
    """x, y and radius of objects that stand well apart on sand and meadow, in the exemplar and then around it.

    None reaches over the edge of the exemplar. taken: objects that stand already. density: on 100 square metres of the
    exemplar. An object for which 200 tries find no place is left out.
    """
    found, blocked = np.zeros((0, 3)), np.maximum(layout.boulders, layout.path)
    count = density * exemplar**2 / 100
    for wanted, inner, outer in ((count, 0.0, exemplar / 2), (2 * count, exemplar / 2, exemplar)):
        for _ in range(round(wanted)):
            radius = rng.uniform(*radii)
            for place in rng.uniform(-outer, outer, (200, 2)):
                reach = np.abs(place).max()
                if reach - radius - CLEAR < inner > 0 or reach + radius + CLEAR > outer:
                    continue
                others = np.vstack([taken, found])
                apart = np.hypot(*(others[:, :2] - place).T) - others[:, 2] - radius
                if (apart > APART).all() and _is_open(blocked, place, radius):
                    found = np.vstack([found, [*place, radius]])
                    break
    return found


def _is_open(blocked: Float[Array, "n n"], place: Float[Array, "2"], radius: float) -> bool:
    """Whether a disc and its surroundings are clear."""
    turn = 2 * np.pi * np.arange(16) / 16
    ring = (radius + CLEAR) * np.column_stack([np.cos(turn), np.sin(turn)])
    x, y = (place + np.vstack([[0, 0], 0.5 * ring, ring])).T
    return bool((noise.sample_raster(blocked, PERIOD, x, y) < 0.3).all())


def _cover_circles(n: int, circles: Float[Array, "k 3"]) -> Float[Array, "n n"]:
    """1 within circles (x, y, radius), 0 beyond 1.2 radii, on n x n texels."""
    covered = np.zeros((n, n))
    for x, y, radius in circles:
        low, high = (np.array([y, x]) + side * 1.2 * radius for side in (-1, 1))
        rows, columns = np.meshgrid(
            *map(np.arange, np.floor(low * n / PERIOD), np.ceil(high * n / PERIOD)), indexing="ij"
        )
        away = np.hypot((columns + 0.5) * PERIOD / n - x, (rows + 0.5) * PERIOD / n - y)
        where = rows.astype(int) % n, columns.astype(int) % n
        covered[where] = np.maximum(covered[where], 1 - smoothstep(radius, 1.2 * radius, away))
    return covered


def _plant_groups(rng, layout: Layout, free: Float[Array, "n n"]) -> Iterator[PlantGroup]:
    """Short grass, which thins out at the border, tufts along it, clover and flowers within."""
    fade = 0.4 * FAR, FAR
    grassy, open_ = _coarsen(layout.meadow), _coarsen(free * (1 - layout.path) ** 2)
    cover = smoothstep(0.25, 0.80, grassy) * open_
    fringe = smoothstep(0.02, 0.45, grassy) * (1 - smoothstep(0.55, 0.98, grassy)) * open_

    def scatter(where, density: float, sizes, lies: float = 0.0) -> Float[Array, "n 4"]:
        """Plants, `density` on 100 square metres where `where` is 1."""
        return land.scatter_plants(rng, where, density * where.mean(), sizes, fade, lies)

    density = land.interpolate(cover)
    near = [plants.make_mat(rng, 265, GRASS / MAT, dry) for dry in (0.08, 0.15, 0.35) for _ in range(3)]
    yield PlantGroup(near, land.lay_mats(rng, density, (0.0, NEAR), MAT, overlap=0.16, jitter=0.35))
    wide = [plants.make_mat(rng, 1300, 1.2 * GRASS / WIDE, 0.2) for _ in range(3)]
    yield PlantGroup(wide, land.lay_mats(rng, land.fade_out(density, *fade), (NEAR, FAR), WIDE, jitter=0.3))
    tufts = [plants.make_tuft(rng) for _ in range(8)]
    within = scatter(cover, 260.0, (0.07, 0.16))
    yield PlantGroup(tufts, np.vstack([within, scatter(fringe, 1400.0, (0.05, 0.13))]))
    yield PlantGroup([plants.make_dry_tuft(rng) for _ in range(5)], scatter(fringe, 500.0, (0.07, 0.18)))
    yield PlantGroup([plants.make_seed_grass(rng) for _ in range(6)], scatter(cover, 90.0, (0.18, 0.32)))
    patches = land.make_patches(rng, 0.3, 2.0)
    clover = [plants.make_clover(rng) for _ in range(4)]
    yield PlantGroup(clover, scatter(cover * patches, 220.0, (0.06, 0.10), lies=1.0))
    for kind, share in zip(plants.MEADOW_FLOWERS, FLOWERING, strict=True):
        where = cover * (0.15 + 0.85 * land.make_patches(rng, 0.35, 2.2))
        flowers = [plants.make_flower(rng, kind) for _ in range(4)]
        heights = 0.8 * kind.heights[0], 0.8 * kind.heights[1]
        yield PlantGroup(flowers, scatter(where, 2.2 * 340.0 * share, heights))


def _coarsen(raster: Float[Array, "n n"]) -> Float[Array, "c c"]:
    """A raster of the ground's texels on the cells of `land`."""
    return noise.sample_raster(raster, PERIOD, *noise.texel_centres(land.CELLS, PERIOD))


def _lay_boulder(rng, single: Float[Array, "3"], height: Height) -> Mesh:
    """A boulder as wide as its circle, a third of it in the ground."""
    x, y, radius = single
    rock = meshes.make_rock(rng, 4, ROCK)
    size = radius / np.hypot(*rock.vertices[:, :2].T).max()
    low, high = rock.vertices[:, 2].min(), rock.vertices[:, 2].max()
    sunk = size * (low + rng.uniform(0.2, 0.4) * (high - low))
    up = height(np.array([x]), np.array([y]))[0] - sunk
    return meshes.transform_mesh(rock, (x, y, up), size, rng.uniform(0, 2 * np.pi))


def _scatter_field(rng, layout: Layout, free: Float[Array, "n n"]) -> list[Float[Array, "_ 3"]]:
    """x, y and size of the stones of the boulder field: big ones, small ones, and, beyond STONE_SQUARE, big ones alone.

    BIG ones lie well within the field.
    """
    near = land.STONE_SQUARE / 2
    boulders, free = (_coarsen(raster) for raster in (layout.boulders, free))
    inner = ndimage.gaussian_filter(boulders, 0.2 * land.CELLS / PERIOD, mode="wrap")
    inner, whole = smoothstep(0.55, 0.9, inner) * free, smoothstep(0.3, 0.9, boulders) * free
    sizes = meshes.draw_sizes(rng, round(STONES * land.STONE_SQUARE**2 / 100), *FIELD)
    big, small = sizes[sizes > BIG], sizes[sizes <= BIG]
    lying = _scatter_touching(rng, big, inner, near, 0.0, np.zeros((0, 3)))
    between = _scatter_touching(rng, small, whole, near, 0.0, lying)
    return [
        lying,
        between,
        _scatter_touching(rng, np.tile(big, 3), inner, 2 * near, near, lying),
    ]  # of 3 times the area


def _scatter_touching(
    rng, sizes: Float[Array, "n"], density: Float[Array, "c c"], reach: float, hole: float, taken: Float[Array, "k 3"]
) -> Float[Array, "m 3"]:
    """x, y and size of stones that may touch but hardly overlap, large ones first, also not those `taken`.

    density: the chance that a stone stays at a place, 0 to 1. reach, hole: half the sides of the square in which they
    lie, and of one within it where none do. A stone without a place in 8 tries is left out.
    """
    placed, count = np.vstack([taken, np.zeros((len(sizes), 3))]), len(taken)
    for size in np.sort(sizes)[::-1]:
        tries = rng.uniform(-reach, reach, (8, 2))
        kept = rng.uniform(size=8) < noise.sample_raster(density, PERIOD, *tries.T)
        for place in tries[kept & (np.abs(tries).max(axis=1) >= hole)]:
            others = placed[:count]
            if (np.hypot(*(others[:, :2] - place).T) > TOUCH * (others[:, 2] + size) / 2).all():
                placed[count] = *place, size
                count += 1
                break
    return placed[len(taken) : count]


def _lay_field(rng, field: list[Float[Array, "_ 3"]], height: Height) -> list[Mesh]:
    """The stones of `_scatter_field`, in ever coarser meshes."""
    found = []
    for rows, kinds, fine in zip(field, (12, 16, 8), (3, 2, 1), strict=True):
        found += _lay(rng, rows, [meshes.make_rock(rng, fine, ROCK) for _ in range(kinds)], height)
    return found


def _lay_pebbles(rng, layout: Layout, free: Float[Array, "n n"], height: Height) -> list[Mesh]:
    """Little stones, most of them in the boulder field and along the path."""
    verge = 4 * layout.path * (1 - layout.path)
    share = (0.18 * (1 - layout.meadow) + layout.boulders + 0.2 * verge) * free * (1 - 0.9 * layout.path)
    most = 0.01 * PEBBLES
    places = land.scatter_points(
        rng, lambda x, y: most * noise.sample_raster(share, PERIOD, x, y), most * share.max(), land.STONE_SQUARE / 2
    )
    sizes = meshes.draw_sizes(rng, len(places), *LITTLE)
    return _lay(rng, np.column_stack([places, sizes]), [meshes.make_stone(rng, 1, ROCK) for _ in range(24)], height)


def _lay(rng, places: Float[Array, "n 3"], kinds: list[Mesh], height: Height) -> list[Mesh]:
    """Stones at x and y, of a size, half sunk into the ground."""
    z = height(places[:, 0], places[:, 1]) + places[:, 2] * rng.uniform(-0.08, 0.16, len(places))
    return land.lay_stones(rng, places, kinds, z)
