"""Objects of a procedural world as clouds of Gaussians: solids by their surfaces, plants by their leaves."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt_study.prior.training.worlds_ground import Map, draw_colour, make_noise

GOLDEN = np.pi * (3.0 - 5.0**0.5)
DIRECTIONS = 4000  # among which the surface of a solid is sampled
MOST_GAUSSIANS = 110_000  # of all objects
SHARES = 0.08, 0.12, 0.2, 0.2, 0.2, 0.1, 0.1  # of worlds with 0, 1, ... kinds of objects
LEAVES = ("moss", "bright moss", "turf", "straw", "lichen", "heath", "leaf litter", "needles")
WOOD = ("loam", "peat", "needles", "ash", "straw")
STONE = ("gravel", "basalt", "slate", "chalk", "ochre", "laterite", "grey sand", "concrete", "clay", "lichen", "snow")


@dataclass(frozen=True)
class Cloud:
    """Gaussians before lighting. quats: x y z w, as in SciPy; the third axis is the normal of the surface.
    opaque: 1 for a surface with one side, 0 for a leaf that light comes through."""

    means: Float[Array, "n 3"]
    quats: Float[Array, "n 4"]
    scales: Float[Array, "n 3"]
    albedo: Float[Array, "n 3"]
    opacity: Float[Array, "n"]
    opaque: Float[Array, "n"]

    def __len__(self) -> int:
        return len(self.means)

    def __getitem__(self, rows) -> "Cloud":
        return Cloud(*(getattr(self, f.name)[rows] for f in fields(self)))


@dataclass(frozen=True)
class Kind:
    """A kind of object. make: an instance about 1 long or high, of a number of Gaussians. size: metres, least and most.
    number: per 100 square metres, least and most. lean: standard deviation of the tilt in radians."""

    make: Callable[[np.random.Generator, int], Cloud]
    gaussians: int
    size: tuple[float, float]
    number: tuple[float, float]
    lean: float = 0.1


def concatenate(clouds: list[Cloud]) -> Cloud:
    """All clouds as one."""
    return Cloud(*(np.concatenate([getattr(c, f.name) for c in clouds]) for f in fields(Cloud)))


def empty_cloud() -> Cloud:
    """No Gaussian."""
    return Cloud(*(np.zeros((0, k) if k else 0) for k in (3, 4, 3, 3, 0, 0)))


def scatter_objects(rng: np.random.Generator, height: Map) -> Cloud:
    """Up to six kinds of objects, scattered over the ground about the origin."""
    names = list(KINDS)
    count = rng.choice(len(SHARES), p=SHARES)
    kinds = [KINDS[names[i]] for i in rng.choice(len(names), count, replace=False)]
    clouds = [scatter_kind(rng, kind, height) for kind in kinds]
    if not sum(map(len, clouds)):
        return empty_cloud()
    room = MOST_GAUSSIANS // len(clouds)
    return concatenate([c[: room // kind.gaussians * kind.gaussians] for kind, c in zip(kinds, clouds, strict=True)])


def scatter_kind(rng: np.random.Generator, kind: Kind, height: Map) -> Cloud:
    """Objects of a kind, clustered or evenly, ordered by their distance from the origin."""
    reach = 6.0 if kind.size[1] < 0.15 else 8.5
    low, high = np.log(kind.number)
    count = rng.poisson(np.exp(rng.uniform(low, high)) * (2 * reach) ** 2 / 100)
    candidates = rng.uniform(-reach, reach, (4 * count, 2))
    dense, groups = make_noise(rng, rng.uniform(1, 6), 0.5, 1.0), rng.uniform(0, 2.5)
    order = np.argsort(-groups * dense(*candidates.T) - rng.gumbel(size=len(candidates)))
    places = candidates[np.sort(order[:count])]
    places = places[np.argsort(np.hypot(*places.T))]
    steep, (least, most) = rng.uniform(0.5, 2), np.log(kind.size)
    sizes = np.exp(least + (most - least) * rng.beta(1.2, 0.8 + steep, len(places)))
    shapes = [kind.make(rng, kind.gaussians) for _ in range(4)]
    return _place_copies(rng, shapes, places, sizes, kind.lean, height)


def _place_copies(rng, shapes: list[Cloud], places: Array, sizes: Array, lean: float, height: Map) -> Cloud:
    """Copies of shapes, each with a rotation, tilt, size and brightness of its own."""
    n = len(places)
    if not n:
        return empty_cloud()
    which, m = rng.integers(len(shapes), size=n), len(shapes[0])
    every = {f.name: np.stack([getattr(s, f.name) for s in shapes])[which] for f in fields(Cloud)}
    axis, angle = rng.uniform(0, 2 * np.pi, n), lean * rng.normal(size=n)
    lie = np.stack([np.cos(axis), np.sin(axis), np.zeros(n)], 1) * angle[:, None]
    turn = Rotation.from_rotvec(lie) * Rotation.from_rotvec(rng.uniform(0, 2 * np.pi, (n, 1)) * [[0, 0, 1.0]])
    turn = Rotation.from_quat(np.repeat(turn.as_quat(), m, 0))
    spread = np.repeat(sizes, m)[:, None]
    means = spread * turn.apply(every["means"].reshape(-1, 3))
    means[:, :2] += np.repeat(places, m, 0)
    means[:, 2] += np.repeat(height(*places.T), m)
    quats = (turn * Rotation.from_quat(every["quats"].reshape(-1, 4))).as_quat()
    shades = np.exp(0.15 * rng.normal(size=(n, 1)) + 0.05 * rng.normal(size=(n, 3)))
    albedo = np.clip(every["albedo"].reshape(-1, 3) * np.repeat(shades, m, 0), 0.004, 0.92)
    scales = spread * every["scales"].reshape(-1, 3)
    return Cloud(means, quats, scales, albedo, every["opacity"].ravel(), every["opaque"].ravel())


def quaternions_from_normals(
    normals: Float[Array, "n 3"], along: Float[Array, "n 3"] | None = None
) -> Float[Array, "n 4"]:
    """Quaternions (x y z w) whose third axis is the normal and whose first axis is nearest to `along`."""
    z = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    if along is None:
        along = np.where(np.abs(z[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    x = along - (along * z).sum(1, keepdims=True) * z
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-12)
    return Rotation.from_matrix(np.stack([x, np.cross(z, x), z], 2)).as_quat()


def sample_surface(
    rng: np.random.Generator,
    count: int,
    planes: Float[Array, "k 3"],
    distances: Float[Array, "k"],
    sharp: float,
    stretch: Float[Array, "3"],
) -> tuple[Float[Array, "count 3"], Float[Array, "count 3"], float]:
    """Points and normals of a solid's surface, evenly by area, and their spacing.

    The solid is a smooth intersection of half-spaces with normals n_k (`planes`) at `distances` a_k: its radius in
    direction d is (sum_k max(0, n_k . d / a_k)^sharp)^(-1/sharp). Then it is stretched along the axes.
    """
    i = np.arange(DIRECTIONS) + 0.5
    up, around = 1 - 2 * i / DIRECTIONS, GOLDEN * i
    flat = np.sqrt(1 - up**2)
    d = np.stack([flat * np.cos(around), flat * np.sin(around), up], 1)
    parts = np.maximum(d @ planes.T / distances, 1e-9)
    ends = ((parts**sharp).sum(1)) ** (-1 / sharp)
    normals = ((parts * ends[:, None]) ** (sharp - 1) / distances) @ planes
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    slant = np.maximum((normals * d).sum(1), 0.1)
    points, normals = ends[:, None] * d * stretch, normals / stretch
    swelling = np.linalg.norm(normals, axis=1) * np.prod(stretch)
    area = ends**2 / slant * swelling * 4 * np.pi / DIRECTIONS
    pick = np.searchsorted(np.cumsum(area), (np.arange(count) + rng.uniform()) / count * area.sum())
    pick = np.minimum(pick, DIRECTIONS - 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points[pick], normals[pick], float(np.sqrt(area.sum() / count))


def make_solid(rng, points: Array, normals: Array, spacing: float, names: tuple[str, ...], sunk: float) -> Cloud:
    """The Gaussians of a solid: stained, banded or overgrown from above. sunk: share of its height under ground."""
    n = len(points)
    base, other = draw_colour(rng, names), draw_colour(rng)
    directions, phases = rng.normal(0, 5, (4, 3)), rng.uniform(0, 6, 4)
    stain = np.sin(points @ directions.T + phases).mean(1)
    if rng.uniform() < 0.3:
        stain = np.sin(points @ rng.normal(0, 12, 3) + stain)
    cover = np.clip(0.6 * stain + 0.4, 0, 1) * rng.uniform(0, 0.7)
    if rng.uniform() < 0.35:
        cover = np.maximum(cover, np.clip(4 * (normals[:, 2] - rng.uniform(0.4, 0.9)) + stain, 0, 1))
    albedo = base + cover[:, None] * (other - base)
    albedo = albedo * np.exp(0.1 * rng.normal(size=(n, 1)))
    low, high = points[:, 2].min(), points[:, 2].max()
    means = points - [0, 0, low + sunk * (high - low)]
    scales = np.broadcast_to([0.62 * spacing, 0.62 * spacing, 0.12 * spacing], (n, 3))
    return Cloud(
        means, quaternions_from_normals(normals), scales, np.clip(albedo, 0.004, 0.92), np.full(n, 0.98), np.ones(n)
    )


def _rock(rng, count: int) -> Cloud:
    planes = rng.normal(size=(rng.integers(7, 22), 3))
    planes = np.concatenate([planes, -planes.sum(0)[None]])
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    distances, sharp = rng.uniform(0.35, 0.5, len(planes)), np.exp(rng.uniform(1.2, 3.5))
    stretch = rng.uniform([0.7, 0.7, 0.4], [1.2, 1.2, 1.0])
    return make_solid(rng, *sample_surface(rng, count, planes, distances, sharp, stretch), STONE, rng.uniform(0.1, 0.4))


def _block(rng, count: int, names=STONE, low=(0.6, 0.3, 0.06), high=(1.0, 1.0, 0.3), sunk=0.2) -> Cloud:
    planes, distances = np.concatenate([np.eye(3), -np.eye(3)]), np.full(6, 0.5)
    shape = sample_surface(rng, count, planes, distances, np.exp(rng.uniform(1.8, 3.2)), rng.uniform(low, high))
    return make_solid(rng, *shape, names, sunk * rng.uniform())


def _round(rng, count: int, names, low, high, sunk) -> Cloud:
    shape = sample_surface(
        rng, count, np.concatenate([np.eye(3), -np.eye(3)]), np.full(6, 0.5), 2.0, rng.uniform(low, high)
    )
    return make_solid(rng, *shape, names, sunk)


def _post(rng, count: int) -> Cloud:
    thick = rng.uniform(0.05, 0.2)
    return _block(rng, count, WOOD + STONE, (thick, thick, 1.0), (thick, thick, 1.3), 0.2)


def _log(rng, count: int) -> Cloud:
    thick = rng.uniform(0.05, 0.16)
    around = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    planes = np.stack([np.zeros(12), np.cos(around), np.sin(around)], 1)
    planes = np.concatenate([planes, [[1, 0, 0], [-1, 0, 0]]])
    shape = sample_surface(rng, count, planes, np.full(14, 0.5), 16.0, np.array([1.0, thick, thick]))
    return make_solid(rng, *shape, WOOD, 0.3 * rng.uniform())


def _cone(rng, count: int) -> Cloud:
    around, rise = np.linspace(0, 2 * np.pi, 9, endpoint=False), rng.uniform(0.2, 0.7)
    planes = np.stack([np.cos(around), np.sin(around), np.full(9, rise)], 1)
    planes = np.concatenate([planes / np.hypot(1, rise), [[0, 0, -1.0]]])
    distances = np.append(np.full(9, 0.3), 0.3)
    stretch = np.array([0.8, 0.8, rng.uniform(0.5, 1.0)])
    return make_solid(
        rng, *sample_surface(rng, count, planes, distances, rng.uniform(6, 25), stretch), STONE + WOOD + LEAVES, 0.05
    )


def _dome(rng, count: int) -> Cloud:
    return _round(rng, count, LEAVES + STONE, (0.8, 0.8, 0.3), (1.1, 1.1, 0.8), 0.5)


def make_leaves(
    rng, means: Array, normals: Array, length: float, width: float, colours: Array, along: Array | None = None
) -> Cloud:
    """Leaves as flat ellipsoids."""
    n = len(means)
    scales = np.stack([np.full(n, length), np.full(n, width), np.full(n, 0.15 * width)], 1)
    scales *= np.exp(0.25 * rng.normal(size=(n, 1)))
    albedo = np.clip(colours * np.exp(0.15 * rng.normal(size=(n, 1)) + 0.05 * rng.normal(size=(n, 3))), 0.004, 0.92)
    quats = quaternions_from_normals(normals, along if along is not None else rng.normal(size=(n, 3)))
    return Cloud(means, quats, scales, albedo, np.full(n, 0.9), np.zeros(n))


def _bush(rng, count: int) -> Cloud:
    lumps = rng.integers(2, 8)
    middles = rng.normal(0, [0.22, 0.22, 0.12], (lumps, 3)) + [0, 0, 0.3]
    radii = rng.uniform(0.15, 0.35, lumps)
    which = rng.choice(lumps, count, p=radii**2 / (radii**2).sum())
    out = rng.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    deep = rng.beta(3, 1, count)
    means = middles[which] + (radii[which] * deep)[:, None] * out
    means[:, 2] = np.abs(means[:, 2])
    first, second = draw_colour(rng, LEAVES), draw_colour(rng, LEAVES)
    colours = first + (rng.uniform(size=(count, 1)) * rng.uniform()) * (second - first)
    colours = np.where(rng.uniform(size=(count, 1)) < 0.15 * rng.uniform(), draw_colour(rng), colours)
    size = rng.uniform(0.5, 1.1) / np.sqrt(count)
    return make_leaves(rng, means, out + 0.8 * rng.normal(size=(count, 3)), size, size * rng.uniform(0.4, 1.0), colours)


def _fronds(rng, count: int, stems: int, lean: tuple[float, float], width: float, droop: float) -> Cloud:
    """Blades that rise from one place, lean outwards and bend down."""
    each = count // stems
    around, tilt = rng.uniform(0, 2 * np.pi, stems), rng.uniform(*lean, stems)
    long, t = rng.uniform(0.6, 1.0, stems), (np.arange(each) + 0.5) / each
    bend = tilt[:, None] + droop * t * rng.uniform(0.3, 1.0, (stems, 1))
    step = long[:, None] / each
    outward = np.cumsum(np.sin(bend), 1) * step + 0.12 * rng.uniform(size=(stems, 1))
    up = np.cumsum(np.cos(bend), 1) * step
    c, s = np.cos(around)[:, None], np.sin(around)[:, None]
    means = np.stack([c * outward, s * outward, np.abs(up)], -1).reshape(-1, 3)
    along = np.stack([c * np.sin(bend), s * np.sin(bend), np.cos(bend)], -1).reshape(-1, 3)
    normals = np.stack([-c * np.cos(bend), -s * np.cos(bend), np.sin(bend)], -1).reshape(-1, 3)
    base, tip = draw_colour(rng, LEAVES), draw_colour(rng, LEAVES)
    colours = base + np.tile(t, stems)[:, None] * (tip - base)
    if rng.uniform() < 0.3:
        colours = np.where(np.tile(t > 0.8, stems)[:, None], draw_colour(rng), colours)
    return make_leaves(rng, means, normals + 0.3 * rng.normal(size=means.shape), 0.5 / each, width, colours, along)


def _stalks(rng, count: int) -> Cloud:
    return _fronds(rng, count, count // 5, (0.0, rng.uniform(0.1, 0.5)), rng.uniform(0.008, 0.02), 0.5)


def _tussock(rng, count: int) -> Cloud:
    return _fronds(rng, count, count // 4, (0.1, 1.3), rng.uniform(0.01, 0.025), 1.2)


def _rosette(rng, count: int) -> Cloud:
    return _fronds(rng, count, count // 5, (0.4, 1.3), rng.uniform(0.03, 0.08), 0.9)


def _treelet(rng, count: int) -> Cloud:
    crown, trunk = _bush(rng, count - 60), _log(rng, 60)
    upright = Rotation.from_euler("y", -90, degrees=True)
    turned = (upright * Rotation.from_quat(trunk.quats)).as_quat()
    means = upright.apply(trunk.means * [0.6, 0.7, 0.7]) + [0, 0, 0.3]
    trunk = replace(trunk, means=means, quats=turned, scales=0.7 * trunk.scales)
    return concatenate([trunk, replace(crown, means=0.75 * crown.means + [0, 0, 0.4], scales=0.75 * crown.scales)])


def _litter(rng, count: int) -> Cloud:
    """A group of fallen leaves."""
    means = rng.normal(0, [0.8, 0.8, 0.03], (count, 3))
    means[:, 2] = 0.05 + np.abs(means[:, 2])
    normals = np.array([0, 0, 1.0]) + 0.4 * rng.normal(size=(count, 3))
    colours = np.where(rng.uniform(size=(count, 1)) < 0.5, draw_colour(rng), draw_colour(rng))
    return make_leaves(rng, means, normals, 0.22, 0.22 * rng.uniform(0.3, 1), colours)


KINDS = {
    "boulders": Kind(_rock, 420, (0.2, 1.3), (2.0, 30.0), 0.3),
    "stones": Kind(_rock, 90, (0.06, 0.35), (15.0, 150.0), 0.5),
    "pebbles": Kind(_rock, 14, (0.03, 0.12), (200.0, 1500.0), 0.5),
    "slabs": Kind(_block, 240, (0.2, 1.4), (3.0, 25.0), 0.2),
    "posts": Kind(_post, 160, (0.3, 1.4), (2.0, 12.0), 0.08),
    "logs": Kind(_log, 220, (0.4, 2.5), (1.0, 12.0), 0.05),
    "sticks": Kind(_log, 20, (0.15, 0.7), (20.0, 200.0), 0.1),
    "cones": Kind(_cone, 300, (0.2, 1.3), (2.0, 15.0), 0.1),
    "hummocks": Kind(_dome, 300, (0.3, 1.6), (3.0, 30.0), 0.1),
    "bushes": Kind(_bush, 500, (0.3, 1.4), (3.0, 60.0), 0.1),
    "cushions": Kind(_bush, 120, (0.1, 0.45), (10.0, 120.0), 0.1),
    "stalks": Kind(_stalks, 120, (0.2, 1.2), (8.0, 250.0), 0.1),
    "tussocks": Kind(_tussock, 120, (0.15, 0.7), (8.0, 300.0), 0.1),
    "sward": Kind(_stalks, 40, (0.12, 0.5), (500.0, 2500.0), 0.2),
    "tufts": Kind(_tussock, 32, (0.06, 0.3), (100.0, 2500.0), 0.2),
    "rosettes": Kind(_rosette, 60, (0.08, 0.6), (15.0, 200.0), 0.1),
    "treelets": Kind(_treelet, 560, (0.7, 1.9), (2.0, 15.0), 0.1),
    "litter": Kind(_litter, 12, (0.04, 0.12), (50.0, 800.0), 0.2),
}
