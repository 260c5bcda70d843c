"""Plants as coloured meshes: shrubs, grasses, clover and flowers.

They are about 1 high (mats, stands and swathes: about 1 across) with their root at the origin, and each face has one
colour.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic.meshes import Mesh, merge_meshes, mix_palette, normalize, transform_mesh

BARK = np.array([[0.26, 0.20, 0.145], [0.20, 0.155, 0.115], [0.33, 0.265, 0.195]])
DRY_LEAF = np.array([[0.235, 0.235, 0.125], [0.36, 0.30, 0.15], [0.29, 0.275, 0.175], [0.40, 0.32, 0.19]])
DRY_GRASS = np.array([[0.56, 0.44, 0.235], [0.48, 0.40, 0.22], [0.60, 0.50, 0.30]])
GREEN = np.array([[0.17, 0.265, 0.05], [0.22, 0.31, 0.065], [0.125, 0.215, 0.042], [0.28, 0.32, 0.09]])
HAY = np.array([[0.42, 0.36, 0.17], [0.36, 0.31, 0.14]])
SEED = np.array([[0.43, 0.36, 0.20], [0.36, 0.26, 0.185], [0.38, 0.37, 0.17]])
CLOVER = np.array([[0.075, 0.165, 0.045], [0.095, 0.195, 0.06]])
LUSH = np.array([[0.125, 0.255, 0.06], [0.165, 0.30, 0.065], [0.10, 0.21, 0.07]])
FRESH = np.array([[0.28, 0.37, 0.07], [0.34, 0.40, 0.10], [0.22, 0.33, 0.065]])
BLUE = np.array([[0.18, 0.275, 0.15], [0.22, 0.31, 0.175], [0.15, 0.235, 0.115]])
STRAW = np.array([[0.52, 0.42, 0.20], [0.45, 0.36, 0.175], [0.58, 0.49, 0.27]])
TAPER = np.array([0.8, 1.0, 0.9, 0.6, 0.1])  # widths along a blade of tall grass


@dataclass(frozen=True)
class Tint:
    """Colours of grass. green: of living blades. dry: share of blades that are straw."""

    green: Float[Array, "k 3"]
    dry: float


TINTS = (Tint(LUSH, 0.10), Tint(FRESH, 0.22), Tint(BLUE, 0.16), Tint(STRAW, 0.35))


@dataclass(frozen=True)
class Flower:
    """A kind of flower: its head in shares of the plant's height, and the least and greatest height in metres."""

    petals: int
    radius: float  # of the head
    width: float  # half that of a petal, as a share of the radius
    lift: float  # of a petal's tip above its base, as a share of the radius
    eye: float  # radius of the middle, as a share of the head's
    colour: tuple[float, float, float]
    middle: tuple[float, float, float]
    heights: tuple[float, float]


MEADOW_FLOWERS = (
    Flower(15, 0.105, 0.15, -0.05, 0.34, (0.80, 0.79, 0.74), (0.66, 0.42, 0.03), (0.16, 0.30)),  # oxeye daisy
    Flower(5, 0.075, 0.46, 0.35, 0.25, (0.78, 0.58, 0.02), (0.58, 0.46, 0.03), (0.16, 0.34)),  # buttercup
    Flower(11, 0.090, 0.22, 0.30, 0.30, (0.23, 0.19, 0.60), (0.14, 0.07, 0.30), (0.20, 0.34)),  # cornflower
    Flower(4, 0.125, 0.62, 0.50, 0.26, (0.64, 0.045, 0.03), (0.04, 0.03, 0.035), (0.22, 0.38)),  # poppy
)


def make_shrub(
    rng: np.random.Generator, palette: Float[Array, "k 3"] = DRY_LEAF, leaves: tuple[int, int] = (7, 15)
) -> Mesh:
    """A desert shrub: bent stems that spread from one root, with twigs and small stiff leaves.

    palette: of its leaves. leaves: on a twig, from the first number to below the second.
    """
    stems = int(rng.integers(26, 36))
    lean = np.radians(rng.uniform(8, 78, stems))
    length = rng.uniform(0.7, 1.05, stems) * (0.82 + 0.18 * np.cos(lean))
    paths = grow_around(rng, scatter_roots(rng, stems, 0.035), lean, length, joints=5, bend=0.16)
    start = sample_paths(paths, rng.uniform(0.25, 1.0, (stems, 13)))
    heading = np.repeat(path_directions(paths)[:, -1], 13, axis=0) + rng.normal(0, 0.62, (stems * 13, 3)) + [0, 0, 0.12]
    long = rng.uniform(0.16, 0.36, stems * 13)
    twigs = grow_paths(rng, start.reshape(-1, 3), normalize(heading), long, joints=3, bend=0.22)
    bark, leaf = mix_palette(rng, BARK), mix_palette(rng, palette)
    parts = [make_rods(paths, 0.012, 0.005, bark, rng), make_rods(twigs, 0.0045, 0.002, bark * 1.12, rng)]
    return merge_meshes([*parts, make_leaves(rng, twigs, int(rng.integers(*leaves)), leaf)])


def make_dry_tuft(rng: np.random.Generator) -> Mesh:
    """A tuft of dry grass: arching blades, each of one colour."""
    n = int(rng.integers(70, 110))
    root = scatter_roots(rng, n, 0.07, 0.02)
    paths = grow_around(rng, root, np.radians(rng.uniform(3, 55, n)), (0.5, 1.1), joints=5, bend=0.10, droop=0.22)
    side = normalize(np.cross(path_directions(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    shade = rng.uniform(0.7, 1.2, (n, 1))
    colours = mix_palette(rng, DRY_GRASS) * shade
    return make_blades(paths, side, [0.011, 0.012, 0.010, 0.007, 0.001], np.repeat(colours[:, None], 4, axis=1))


def make_mat(rng: np.random.Generator, count: int, length: float, dry: float) -> Mesh:
    """Short grass on a disc about 1 across: `count` blades about `length` long. dry: share of straw."""
    root = scatter_on_disc(rng, count, 0.1 * length)
    lean = np.radians(rng.uniform(5, 70, count))
    heading = to_direction(lean, rng.uniform(0, 2 * np.pi, count))
    paths = grow_paths(rng, root, heading, length * rng.uniform(0.5, 1.3, count), joints=3, bend=0.12, droop=0.35)
    return _make_short_grass(rng, paths, [0.055 * length, 0.048 * length, 0.004 * length], dry)


def make_tuft(rng: np.random.Generator) -> Mesh:
    """A tuft of green grass with arching blades."""
    count = int(rng.integers(55, 90))
    root = scatter_roots(rng, count, 0.09, 0.04)
    lean = np.radians(rng.uniform(2, 48, count))
    paths = grow_around(rng, root, lean, rng.uniform(0.5, 1.2, count), joints=6, bend=0.10, droop=0.20)
    return _make_short_grass(rng, paths, [0.016, 0.019, 0.018, 0.015, 0.010, 0.001], dry=0.12)


def make_seed_grass(rng: np.random.Generator) -> Mesh:
    """Grass in seed: thin stems with an ear each, and some blades about the root."""
    count = int(rng.integers(6, 13))
    root = scatter_roots(rng, count, 0.05)
    lean = np.radians(rng.uniform(1, 20, count))
    stems = grow_around(rng, root, lean, (0.8, 1.1), 6, 0.05, droop=0.03)
    straw = mix_palette(rng, SEED)
    ears = make_leaves(rng, stems[:, -2:], 26, straw)
    low = grow_around(rng, root, 2.2 * lean, (0.3, 0.6), 4, 0.10, droop=0.22)
    rods = make_rods(stems, 0.005, 0.003, 0.8 * straw, rng)
    return merge_meshes([rods, ears, _make_short_grass(rng, low, [0.012, 0.012, 0.009, 0.001], 0.15)])


def make_clover(rng: np.random.Generator) -> Mesh:
    """Clover: three leaflets at the end of every stem, spread flat."""
    count = int(rng.integers(22, 34))
    root = scatter_roots(rng, count, 0.25, 0.05)
    stems = grow_around(rng, root, np.radians(rng.uniform(5, 50, count)), (0.6, 1.1), 3, 0.1)
    green = mix_palette(rng, CLOVER)
    turn = rng.uniform(0, 2 * np.pi, (count, 1)) + 2 * np.pi / 3 * np.arange(3)
    tilt = rng.normal(0, 0.25, (count, 3))
    out = np.stack([np.cos(turn), np.sin(turn), tilt], axis=-1).reshape(-1, 3)
    end = np.repeat(stems[:, -1], 3, axis=0)
    paths = np.stack([end, end + 0.13 * out, end + 0.30 * out], axis=1)
    across = normalize(np.cross(out, [0, 0, 1.0]))
    tint = green * rng.uniform(0.75, 1.3, (count * 3, 1))
    leaflets = make_blades(paths, across, [0.01, 0.13, 0.09], np.stack([tint * 1.3, tint], axis=1))
    return merge_meshes([make_rods(stems, 0.012, 0.010, green, rng), leaflets])


def make_flower(rng: np.random.Generator, kind: Flower, most: int = 4) -> Mesh:
    """A plant with one to `most` stems, each with a few narrow leaves and a flower."""
    count, many = int(rng.integers(1, most + 1)), 12
    root = scatter_roots(rng, count, 0.03)
    stems = grow_around(rng, root, np.radians(rng.uniform(2, 24, count)), (0.7, 1.05), 6, 0.07)
    green = mix_palette(rng, GREEN)
    foot = np.repeat(root, many, axis=0) + rng.normal(0, 0.02, (many * count, 3))
    low = grow_around(rng, foot, np.radians(rng.uniform(25, 75, len(foot))), (0.15, 0.42), 4, 0.1, droop=0.12)
    parts = [make_rods(stems, 0.012, 0.008, green, rng), make_leaves(rng, stems, 9, green)]
    parts.append(_make_short_grass(rng, low, [0.012, 0.026, 0.022, 0.002], dry=0.05))
    for stem in stems:  # each has a flower at its end, which faces along it and upwards
        facing = normalize(path_directions(stem[None])[0, -1] + [0, 0, 0.8] + rng.normal(0, 0.18, 3))
        parts.append(_make_flower_head(rng, stem[-1], facing, kind))
    return merge_meshes(parts)


def make_swathe(rng: np.random.Generator, plants: list[Mesh], count: int, heights: tuple[float, float]) -> Mesh:
    """`count` plants spread over a disc about 1 across, between `heights` high in discs."""
    where = scatter_on_disc(rng, count, 0.0)
    picked = ((plants[rng.integers(len(plants))], at, rng.uniform(*heights)) for at in where)
    return merge_meshes([transform_mesh(*plant, rng.uniform(0, 2 * np.pi)) for plant in picked])


def make_stand(rng: np.random.Generator, count: int, length: float, width: float, tint: Tint) -> Mesh:
    """Upright grass on a disc about 1 across: `count` blades about `length` long, half `width` wide, bent towards +x.

    A third of the blades are short and fill the bottom of the sward.
    """
    root = scatter_on_disc(rng, count, 0.06 * length)
    low = rng.uniform(size=count) < 0.35
    long = length * np.where(low, rng.uniform(0.25, 0.6, count), rng.uniform(0.6, 1.2, count))
    lean = np.radians(np.where(low, rng.uniform(5, 60, count), rng.uniform(2, 26, count)))
    heading = normalize(to_direction(lean, rng.uniform(0, 2 * np.pi, count)) + [0.22, 0, 0])
    sweep = 0.16 * long[:, None, None] * (np.linspace(0, 1, 5) ** 2)[None, :, None] * np.array([1.0, 0.0, -0.35])
    paths = grow_paths(rng, root, heading, long, joints=5, bend=0.07, droop=0.12) + sweep
    return _make_grass(rng, paths, width * TAPER, tint, (0.6, 1.5))


def _make_flower_head(rng, centre, facing, kind: Flower) -> Mesh:
    """Petals around a raised centre."""
    u = normalize(np.cross(facing, rng.normal(0, 1, 3)))
    v = np.cross(facing, u)
    radius = kind.radius * rng.uniform(0.85, 1.12)
    turn = 2 * np.pi / kind.petals * (np.arange(kind.petals) + rng.uniform(0, 1) + rng.normal(0, 0.07, kind.petals))
    out = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    rise = radius * kind.lift * facing * rng.uniform(0.7, 1.3, (kind.petals, 1))
    long = radius * rng.uniform(0.9, 1.08, (kind.petals, 1))
    joints = [centre + 0.15 * long * out, centre + 0.62 * long * out + 0.4 * rise, centre + long * out + rise]
    wide = radius * kind.width
    tint = np.array(kind.colour) * rng.uniform(0.85, 1.08, (kind.petals, 1))
    colours = np.stack([0.88 * tint, tint], axis=1)
    petals = make_blades(np.stack(joints, 1), np.cross(facing, out), [0.35 * wide, wide, 0.6 * wide], colours)
    index = np.arange(8)
    ring = 2 * np.pi / 8 * index
    rim = centre + kind.eye * radius * (np.cos(ring)[:, None] * u + np.sin(ring)[:, None] * v) + 0.04 * radius * facing
    top = centre + 0.55 * kind.eye * radius * facing
    faces = np.column_stack([index, (index + 1) % 8, np.full(8, 8)])
    eye = np.tile(np.array(kind.middle), (9, 1)).astype(np.float32)
    return merge_meshes([petals, Mesh(np.vstack([rim, top]).astype(np.float32), faces, eye)])


def _make_short_grass(rng, paths, width: list[float], dry: float) -> Mesh:
    """Blades of meadow grass along paths. dry: share of straw."""
    return _make_grass(rng, paths, width, Tint(GREEN, dry), (0.62, 1.12), HAY, 0.7, ripe=0.0)


def _make_grass(
    rng, paths, width, tint: Tint, light: tuple[float, float], straw=STRAW, pale: float = 0.6, ripe: float = 0.35
) -> Mesh:
    """Blades of grass along paths.

    light: factor of the colour at root and tip. pale: least tone of straw. ripe: how far a tip may turn to straw.
    """
    n, joints = paths.shape[:2]
    side = normalize(np.cross(path_directions(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    green = mix_palette(rng, tint.green) * rng.uniform(0.7, 1.25, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3))
    yellow = mix_palette(rng, straw) * rng.uniform(pale, 1.15, (n, 1))
    colour = np.where(rng.uniform(size=(n, 1)) < tint.dry, yellow, green)
    ripening = np.linspace(0, 1, joints - 1)[None, :, None] ** 3 * (rng.uniform(0, ripe, (n, 1, 1)) if ripe else 0.0)
    shade = np.linspace(*light, joints - 1)[None, :, None]
    colours = (colour[:, None] * (1 - ripening) + yellow[:, None] * ripening) * shade
    return make_blades(paths, side, width, np.clip(colours, 0.01, 0.95))


def scatter_roots(rng: np.random.Generator, count: int, spread: float, depth: float = 0.03) -> Float[Array, "n 3"]:
    """Roots about the origin, normally distributed, a little below the ground."""
    return np.column_stack([rng.normal(0, spread, (count, 2)), np.full(count, -depth)])


def scatter_on_disc(rng: np.random.Generator, count: int, depth: float) -> Float[Array, "n 3"]:
    """Places spread evenly over a disc 1 across, `depth` below the ground."""
    radius, turn = 0.5 * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, -depth)])


def grow_paths(
    rng, start, direction, length, joints: int, bend: float, droop: float = -0.05
) -> Float[Array, "n joints 3"]:
    """Paths of `joints` points from `start` along `direction` that bend at random and sink (or rise) by `droop`."""
    points, heading = [start], direction
    for _ in range(joints - 1):
        points.append(points[-1] + heading * (length / (joints - 1))[:, None])
        heading = normalize(heading + rng.normal(0, bend, heading.shape) - [0, 0, droop])
    return np.stack(points, axis=1)


def grow_around(rng, root, lean, length, joints: int, bend: float, droop: float = -0.05) -> Float[Array, "n joints 3"]:
    """Paths as of `grow_paths` from roots, spread around the vertical evenly but for some jitter, in random order.

    lean: from the vertical, radians. length: one per path, or the least and the most as a tuple.
    """
    n = len(root)
    heading = to_direction(lean, 2 * np.pi * (rng.permutation(n) + rng.uniform(-0.4, 0.4, n)) / n)
    long = rng.uniform(*length, n) if isinstance(length, tuple) else length
    return grow_paths(rng, root, heading, long, joints, bend, droop)


def sample_paths(paths: Float[Array, "n joints 3"], share: Float[Array, "n m"]) -> Float[Array, "n m 3"]:
    """Points at shares 0 to 1 of every path."""
    place = share * (paths.shape[1] - 1)
    first = np.minimum(place.astype(int), paths.shape[1] - 2)
    row, rest = np.arange(len(paths))[:, None], (place - first)[..., None]
    return paths[row, first] * (1 - rest) + paths[row, first + 1] * rest


def path_directions(paths: Float[Array, "n joints 3"]) -> Float[Array, "n pieces 3"]:
    """Unit vectors between the joints of paths."""
    return normalize(np.diff(paths, axis=1))


def to_direction(lean, azimuth) -> Float[Array, "n 3"]:
    """Unit vectors by their angle to the vertical and their azimuth, radians."""
    return np.column_stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])


def make_blades(
    paths: Float[Array, "n joints 3"], side: Float[Array, "n 3"], width, colours: Float[Array, "n pieces 3"]
) -> Mesh:
    """Flat blades along paths, `width` to either side of each joint, with a colour per piece between joints."""
    reach = side[:, None] * np.array(width)[None, :, None]
    one, other = paths - reach, paths + reach
    corners = np.stack([one[:, :-1], other[:, :-1], other[:, 1:], one[:, 1:]], axis=2)  # n, pieces, 4, 3
    return _make_quads(corners.reshape(-1, 4, 3), colours.reshape(-1, 3))


def make_rods(paths, thick: float, thin: float, colour, rng) -> Mesh:
    """Three-sided rods along paths, their radius falling from `thick` to `thin`."""
    n, joints = paths.shape[:2]
    across = normalize(np.cross(path_directions(paths)[:, :1], rng.normal(0, 1, (n, 1, 3))))
    up = normalize(np.cross(path_directions(paths)[:, :1], across))
    radius = np.linspace(thick, thin, joints)[None, :, None]
    ring = [paths + radius * (np.cos(t) * across + np.sin(t) * up) for t in 2 * np.pi / 3 * np.arange(3)]
    vertices = np.stack(ring, axis=2)  # n, joints, 3, 3
    index = np.arange(n * joints * 3).reshape(n, joints, 3)
    turned = np.roll(index, -1, axis=2)
    a, b, c, d = index[:, :-1], turned[:, :-1], turned[:, 1:], index[:, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    shade = rng.uniform(0.75, 1.2, (n, 1, 1, 1)) * np.ones((1, joints, 3, 1))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, (shade * colour).reshape(-1, 3).astype(np.float32))


def make_leaves(rng, twigs, each: int, colour) -> Mesh:
    """Rhombic leaves, `each` per twig, about 0.05 long."""
    n = len(twigs) * each
    base = sample_paths(twigs, rng.uniform(0.15, 1.0, (len(twigs), each))).reshape(-1, 3)
    ahead = np.repeat(path_directions(twigs)[:, -1], each, axis=0)
    ahead = normalize(ahead + rng.normal(0, 0.8, (n, 3))) * rng.uniform(0.035, 0.07, (n, 1))
    wide = normalize(np.cross(ahead, rng.normal(0, 1, (n, 3)))) * rng.uniform(0.007, 0.014, (n, 1))
    corners = np.stack([base, base + 0.5 * ahead + wide, base + ahead, base + 0.5 * ahead - wide], axis=1)
    return _make_quads(corners, colour * rng.uniform(0.7, 1.3, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3)))


def _make_quads(corners: Float[Array, "n 4 3"], colours: Float[Array, "n 3"]) -> Mesh:
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    by_vertex = np.repeat(colours, 4, axis=0)
    return Mesh(corners.reshape(-1, 3).astype(np.float32), faces, by_vertex.astype(np.float32))
