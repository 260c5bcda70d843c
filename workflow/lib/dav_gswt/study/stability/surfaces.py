"""Checks of what lies far out: classes by height, scattered things, tiles on a sphere, places in exported files."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.bundle.land_cover import ClassesEntry, JitterEntry, ObjectOrders, RangeTerm, RiseEntry, ScatterEntry
from dav_gswt.field import GaussianField
from dav_gswt.materials.segmentation import WEIGHTS, compare_classes
from dav_gswt.study.stability.formula import FLOAT32_EPS, Case, Check
from dav_gswt.study.stability.levels import hash_exactly
from dav_gswt.terrain import classes, heights, scatter, sphere
from dav_gswt.terrain.heights import FlatSurface

SOFT = (1e-12, 1e-3, 1.0, 1e6)  # softness of a range of heights
RADII = (1.0, 4.0, 40.0, 1e3, 1e5, 1e7)  # of spheres, in tile sides
FAR = (0, 2**20, 2**30, 2**40)  # cells from the origin
GRID = 4  # squares of the scatter along a cell's side
SIDE = 0.7  # of a tile whose positions are exported, in units


@dataclass(frozen=True)
class Ramp(heights.HeightField, kind="ramp"):
    """A surface as high as its place lies east: lattice point i of a tile 8 units wide is i high."""

    def at(self, x: Array, y: Array) -> tuple[Array, Array]:
        return x, np.stack([np.ones_like(x), np.zeros_like(x)], 1)


def _range_cases() -> list[Case]:
    near = [0, 1, 2, 3, 999, 1000, 1001, 1004, 10**6, 2**40]
    height = np.array([*near, *(-value for value in near)], np.int64)
    return [Case(f"softness {soft:g}, height ", (height, soft), height) for soft in SOFT]


def _score_range(height: Array, soft: float) -> Array:
    """The score of a material that is found between heights of 0 and 1000."""
    term, rise = RangeTerm("height", 1.0, 0, 0.0, 1000.0, soft), RiseEntry(0.0, 0.0, [0.0, 0.0], [0.0, 0.0])
    entry = ClassesEntry(0, [term], JitterEntry(1, 1, 0.0), rise)
    made = classes.Classes(entry, 2, float(classes.LATTICE), Ramp())
    return made.lattice_scores(height, np.zeros_like(height))[:, 0]


def _range_reference(height: Array, soft: float) -> Array:
    outside = (max(0 - at, at - 1000, 0) / Fraction(soft) for at in height.tolist())
    return np.array([-float(min(value, Fraction(classes.FARTHEST))) for value in outside])


def _class_cases() -> list[Case]:
    rng, half = np.random.default_rng(0), np.arange(32) < 16
    grain = rng.standard_normal((32, 32, 4))
    cases = [Case("nothing differs", (np.full((32, 32, 4), 50.0), half))]
    for size in (1e-6, 1.0, 1e6):
        for about in (0.0, 100 * size):
            for step in (1e-6, 1.0):
                values = about + size * (grain + step * half[:, None])
                cases.append(Case(f"spread {size:g} about {about:g}, {step:g} of it apart", (values, half)))
    return cases


def _compare(features: Array, half: Array) -> Array:
    """Distance, grain and separation of two classes, a half of the columns each."""
    labels = np.broadcast_to(half.astype(int), features.shape[:2])
    found = compare_classes(features, labels, 0, 1)
    return np.array([found.distance, found.grain, found.separation])


def _compare_reference(features: Array, half: Array) -> Array:
    one, two = (features[:, part].reshape(-1, 4).astype(np.longdouble) for part in (~half, half))
    step = two.mean(0) - one.mean(0)
    distance = np.sqrt((step * step).sum())
    if distance == 0:
        return np.zeros(3)
    spread = np.sqrt(((one @ step / distance).var() + (two @ step / distance).var()) / 2)
    return np.array([distance, abs(step[-1]) / np.longdouble(WEIGHTS[-1]), distance / spread], float)


def _scatter_cases() -> list[Case]:
    return [
        Case(f"cell ({sign * far}, {-sign * far}), salt {salt}", (sign * far, -sign * far, salt))
        for far in FAR
        for sign in (1, -1)
        for salt in (0, 2**32 - 1)
    ]


def _scatter(i: int, j: int, salt: int) -> Array:
    """Place, turn and size of all things in a cell: so small that none is in another's way."""
    thing = ObjectOrders("thing", 1e-9, [0.0, 1.0], 0.0, 0, 1.0, 1.0, [])
    made = scatter.Scatter(ScatterEntry(GRID, 15.0, 0.15, salt), [thing], 1.0)
    found = made.instances_in(np.array([i]), np.array([j]))
    rows = np.stack([found.u, found.v, found.turn, found.size], 1)
    return rows[np.lexsort((np.floor(found.u * GRID), np.floor(found.v * GRID)))]


def _scatter_reference(i: int, j: int, salt: int) -> Array:
    rows = []
    for b in range(GRID):
        for a in range(GRID):
            place, form = (
                hash_exactly(i * GRID + a, j * GRID + b, axis, salt) for axis in (scatter.PLACE, scatter.FORM)
            )
            u, v = ((k + Fraction(2 * bits + 1, 2**17)) / GRID for k, bits in ((a, place % 2**16), (b, place >> 16)))
            turn, size = (Fraction(bits, 2**16 - 1) * 2 - 1 for bits in (form >> 16, form % 2**16))
            rows.append([float(u), float(v), float(15 * turn), float(1 + Fraction(0.15) * size)])
    return np.array(rows)


def _sphere_cases() -> list[Case]:
    rng, cases = np.random.default_rng(0), []
    rim = np.array([[x, y, 0] for x in (-0.5, 0, 0.5) for y in (-0.5, 0, 0.5)])
    local = np.concatenate([rim, rng.uniform(-0.5, 0.5, (20, 3)) * [1, 1, 0.2]])
    for radius in RADII:
        cells = heights.make_sphere(radius, 1.0).cells
        for i, j in ((0, 0), (cells // 2, 0), (cells // 2, cells // 2), (cells - 1, cells // 3)):
            cases.append(Case(f"radius {radius:g}, cell ({i}, {j})", (radius, i, j, local)))
    return cases


def _bend(radius: float, i: int, j: int, local: Array) -> Array:
    """Points of a tile on a sphere, from the tile's middle, in float32."""
    ball = heights.make_sphere(radius, 1.0)
    tangents = ball.tangents(np.array(i + 0.5), np.array(j + 0.5)).astype(np.float32)
    return sphere.bend(local.astype(np.float32), tangents, ball.radius, ball.rate)[0]


def _place_exactly(radius: float, i: int, j: int, local: Array) -> Array:
    """The same points from the planet's middle, in 80 bits; the last one is the tile's middle."""
    ball, real = heights.make_sphere(radius, 1.0), np.longdouble
    points = np.concatenate([local, np.zeros((1, 3))]).astype(real)
    angles = ((points[:, :2] + np.array([i, j], real) + real(0.5)) / ball.cells - real(0.5)) * 2 * np.arctan(real(1))
    ray = np.concatenate([np.tan(angles), np.ones_like(points[:, :1])], 1)
    return ray / np.sqrt((ray * ray).sum(1, keepdims=True)) * (real(radius) + points[:, 2:])


def _bend_reference(radius: float, i: int, j: int, local: Array) -> Array:
    points = _place_exactly(radius, i, j, local)
    return (points[:-1] - points[-1]).astype(float)


def _bend_naive(radius: float, i: int, j: int, local: Array) -> Array:
    """By positions from the planet's middle in float32."""
    points = _place_exactly(radius, i, j, local).astype(np.float32)
    return points[:-1] - points[-1]


def _export_cases() -> list[Case]:
    local = np.random.default_rng(0).uniform(0, SIDE, (40, 3)).astype(np.float32)
    return [
        Case(f"{cells} x {cells} cells, {far} cells from the origin", (far, cells, local))
        for far in (0, 2**20, 2**30)
        for cells in (1, 20, 1000)
    ]


def _export(far: int, cells: int, local: Array) -> Array:
    """Positions of a tile in the last cell of an area, from its middle, in tile sides."""
    last, middle = far + cells - 1, far + cells / 2
    corner, origin = np.array([last, last, 0]) * SIDE, np.array([middle, middle, 0]) * SIDE
    means = heights.displace_means(_as_field(local), FlatSurface(), corner, origin)[0].means
    return means.astype(np.float64) / SIDE


def _export_reference(far: int, cells: int, local: Array) -> Array:
    by = Fraction(cells, 2) - 1
    side = Fraction(SIDE)
    return np.array([[float(Fraction(v) / side + by * (k < 2)) for k, v in enumerate(row)] for row in local.tolist()])


def _export_naive(far: int, cells: int, local: Array) -> Array:
    """By positions from the world's origin in float32."""
    level = np.array([1, 1, 0], np.float32)
    last, middle = (np.float32(at * SIDE) * level for at in (far + cells - 1, far + cells / 2))
    return (local + last - middle).astype(np.float64) / SIDE


def _as_field(means: Array) -> GaussianField:
    n, zero = len(means), np.zeros(len(means), np.float32)
    turns = np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1))
    return GaussianField(
        means, np.zeros((n, 3), np.float32), turns, zero, np.zeros((n, 1, 3), np.float32), zero, zero > 0
    )


CHECKS = [
    Check("score of a material outside of its heights", _range_cases, _score_range, _range_reference, relative=1e-12),
    Check(
        "difference of two classes of ground: distance, grain, separation",
        _class_cases,
        _compare,
        _compare_reference,
        relative=1e-9,
    ),
    Check("where a thing stands in its cell", _scatter_cases, _scatter, _scatter_reference, absolute=1e-12),
    Check(
        "a place in a tile on a sphere",
        _sphere_cases,
        _bend,
        _bend_reference,
        absolute=5e-7,
        printed=_bend_naive,
    ),
    Check(
        "a place in an exported file",
        _export_cases,
        _export,
        _export_reference,
        relative=FLOAT32_EPS,
        absolute=1e-6,
        printed=_export_naive,
    ),
]
