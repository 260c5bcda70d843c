"""Checks of the terrain: level weights, cross-fades, Gaussians on slopes, hills, the tile of a cell."""

import math
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.bundle import level_distances
from dav_gswt.field import GaussianField
from dav_gswt.study.stability.formula import FLOAT32, FLOAT32_EPS, Case, Check
from dav_gswt.terrain import draw_order, heights
from dav_gswt.terrain.choice import hash_cell
from dav_gswt.terrain.heights import GAIN, HILLS, SHIFT, Hills

BANDS = (0.0, 1e-12, 1e-3, 1.0, 1e6)
SWITCHES = (2.0**-10, 1.0, 1024.0, 2.0**20)
EYE = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 12, 97)])


def _distance_cases() -> list[Case]:
    cases = []
    for switch in SWITCHES:
        near = switch * (1 + np.linspace(-2, 2, 41))
        for band in BANDS:
            d = np.concatenate([EYE, near, switch + band * np.linspace(-1.5, 1.5, 31)]).clip(0).astype(np.float32)
            cases.append(Case(f"D {switch:g}, Delta {band:g}, d = ", (d, switch, band), d))
    return cases


def _alpha_reference(d: Array, switch: float, band: float, smooth: bool = False) -> Array:
    cases = []
    for x in d.astype(np.float64):
        if band > 0:
            s = min(max(0.5 - (x - switch) / (2 * band), 0.0), 1.0)
        else:
            s = 1.0 if x < switch else 0.0 if x > switch else 0.5
        cases.append(s * s * (3 - 2 * s) if smooth else s)
    return np.array(cases)


def _alpha_printed(d: Array, switch: float, band: float) -> Array:
    """As printed: 0 outside the band."""
    inside = (switch - band <= d) & (d < switch + band)
    return np.where(inside, np.float32(0.5) - (d - np.float32(switch)) / np.float32(2 * band), np.float32(0))


def _level_cases() -> list[Case]:
    cases = []
    for band in BANDS:
        switches = [1.0, 2.0, 4.0, 1024.0, np.inf]
        cases.append(Case(f"five levels, Delta {band:g}, d = ", (EYE.astype(np.float32), switches, [band] * 5), EYE))
    return cases


def _crossfade_cases() -> list[Case]:
    w = np.concatenate([[0.0, 1.0], 10.0 ** np.linspace(-12, 0, 49), 1 - 10.0 ** np.linspace(-7, -1, 13)])
    opaque = np.array([0.0, 1e-12, 1e-6, 1 / 255, 0.5, 0.9, 0.99, 1 - 1e-3, 1 - 1e-5, 1.0])
    return [Case(f"alpha {a:.7g}, w = ", (np.full(len(w), a, np.float32), w.astype(np.float32)), w) for a in opaque]


def _crossfade_reference(a: Array, w: Array) -> Array:
    """1 - (1 - alpha)^w of the same arguments, alpha held below 1 - 1e-6."""
    most = float(np.float32(1 - 1e-6))
    cases = []
    for x, y in zip(a.astype(np.float64).tolist(), w.astype(np.float64).tolist(), strict=True):
        cases.append(x if y == 1 else 0.0 if y == 0 else -math.expm1(y * math.log1p(-min(x, most))))
    return np.array(cases)


def _composite_twice(fade, a: Array, w: Array) -> Array:
    """Opacity of two equal Gaussians, one weighted by w, the other by 1 - w."""
    one = np.ones_like(a)
    return one - (one - fade(a, w)) * (one - fade(a, one - w))


def _equal_splat_cases() -> list[Case]:
    w = np.linspace(0, 1, 33).astype(np.float32)
    return [Case(f"alpha {a:g}, w = ", (np.full(33, a, np.float32), w), w) for a in (1e-6, 0.1, 0.9, 0.99, 0.999)]


def _switch_distance(scale: float) -> float:
    distance = level_distances.compute_levels([0.5 * scale, scale], 1.0, 0.1)[0].distance
    assert distance is not None  # of the last level alone
    return distance


def _shape_cases() -> list[Case]:
    cases, rng = [], np.random.default_rng(0)
    quats = rng.standard_normal((40, 4)).astype(np.float32)
    for scales in ((1e-12, 1e-12, 1e-12), (1e6, 1e6, 1e6), (1e6, 1.0, 1.0), (1.0, 1.0, 1e-6), (1e-12, 1.0, 1e6)):
        for steep in (0.0, 1.0, 1e3):
            slope = np.tile(np.array([steep, -0.5 * steep]), (40, 1))
            cases.append(Case(f"scales {scales}, slope {steep:g}", (quats, scales, slope)))
    return cases


def _drape(quats: Array, scales: tuple, slope: Array) -> Array:
    """The shape A of every Gaussian (its covariance is A A^T), each column over its scale."""
    n = len(quats)
    logs = np.tile(np.log(np.array(scales)).astype(np.float32), (n, 1))
    zero = np.zeros(n, np.float32)
    field = GaussianField(
        np.zeros((n, 3), np.float32), logs, quats, zero, np.zeros((n, 1, 3), np.float32), zero, zero > 0
    )
    return heights.displaced_axes(field, slope) / np.exp(logs.astype(np.float64))[:, None]


def _drape_reference(quats: Array, scales: tuple, slope: Array) -> Array:
    cases = []
    for q, (east, north) in zip(quats.astype(np.float64), slope, strict=True):
        w, x, y, z = q / math.sqrt(sum(v * v for v in q))
        turn = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        cases.append(np.array([[1, 0, 0], [0, 1, 0], [east, north, 1]]) @ turn)
    return np.array(cases)


def _place_cases() -> list[Case]:
    cases, rng = [], np.random.default_rng(0)
    for far in (0.0, 1e3, 1e6, 1e9):
        x, y = (np.floor(far + rng.uniform(0, 64, 24)) + rng.integers(0, 64, 24) / 64 for _ in range(2))
        cases.append(Case(f"{far:g} units from the origin", (x, y)))
    return cases


def _hills(x: Array, y: Array) -> Array:
    height, slope = Hills(2.0, 8.0, 4, 3).at(x, y)
    return np.column_stack([height, slope])


def _hills_reference(x: Array, y: Array) -> Array:
    """Height and slopes in exact fractions, so that cells far from the origin are right as well."""
    shares = [GAIN**k for k in range(4)]
    cases = []
    for at in zip(x.tolist(), y.tolist(), strict=True):
        parts = [
            np.array(_octave(k, *(Fraction(v) * 2**k / 8 + k * Fraction(s) for v, s in zip(at, SHIFT, strict=True))))
            for k in range(4)
        ]
        total = sum(
            2.0 * a / sum(shares) * p * [1, 2**k / 8, 2**k / 8]
            for k, (a, p) in enumerate(zip(shares, parts, strict=True))
        )
        cases.append(total)
    return np.array(cases)


def _octave(k: int, x: Fraction, y: Fraction) -> tuple[float, float, float]:
    i, j = math.floor(x), math.floor(y)
    u, v = x - i, y - j

    def fade(t: Fraction) -> tuple[Fraction, Fraction]:
        return t**3 * (t * (6 * t - 15) + 10), 30 * t * t * (t * (t - 2) + 1)

    value = by_x = by_y = Fraction(0)
    for a in (0, 1):
        for b in (0, 1):
            bits = int(hash_cell(i + a, j + b, HILLS + k, 3))
            east, north = Fraction(bits & 0xFFFF) / Fraction(32767.5) - 1, Fraction(bits >> 16) / Fraction(32767.5) - 1
            (fx, tx), (fy, ty) = fade(u), fade(v)
            (fx, tx), (fy, ty) = (fx, tx) if a else (1 - fx, -tx), (fy, ty) if b else (1 - fy, -ty)
            plane = east * (u - a) + north * (v - b)
            value += fx * fy * plane
            by_x += fx * fy * east + tx * fy * plane
            by_y += fx * fy * north + fx * ty * plane
    return float(value), float(by_x), float(by_y)


def _cell_cases() -> list[Case]:
    edge = [0, 1, -1, 2**31 - 1, -(2**31), 2**32, 2**53, -(2**53), 2**62, -(2**63)]
    i, j = (a.ravel() for a in np.meshgrid(np.array(edge, np.int64), np.array(edge, np.int64)))
    return [Case(f"salt {salt}, i = ", (i, j, salt), i) for salt in (0, 1, 2**32 - 1)]


def _hash(i: Array, j: Array, salt: int) -> Array:
    with np.errstate(over="ignore"):
        return np.asarray(hash_cell(i, j, 2, salt), np.float64)


def _hash_reference(i: Array, j: Array, salt: int) -> Array:
    return np.array([hash_exactly(a, b, 2, salt) for a, b in zip(i.tolist(), j.tolist(), strict=True)], np.float64)


def hash_exactly(i: int, j: int, axis: int, salt: int) -> int:
    """`choice.hash_cell` in integers of any size."""

    def mix(h: int) -> int:
        h = (h ^ h >> 16) * 0x85EBCA6B % 2**32
        h = (h ^ h >> 13) * 0xC2B2AE35 % 2**32
        return h ^ h >> 16

    first = mix((i * 0x8DA6B343 ^ axis * 0xCB1AB31F ^ salt) % 2**32)
    return mix((first + j * 0xD8163841) % 2**32)


CHECKS = [
    Check(
        "LOD alpha: clip(1/2 - (d - D) / (2 Delta), 0, 1)",
        _distance_cases,
        draw_order.finer_share,
        _alpha_reference,
        relative=FLOAT32,
        absolute=1e-6,
        printed=_alpha_printed,
    ),
    Check(
        "LOD alpha, smooth",
        _distance_cases,
        lambda d, switch, band: draw_order.finer_share(d, switch, band, True),
        lambda d, switch, band: _alpha_reference(d, switch, band, True),
        relative=FLOAT32,
        absolute=1e-6,
    ),
    Check(
        "LOD: weights of all levels sum to 1",
        _level_cases,
        lambda d, s, b: draw_order.level_weights(d, s, b).astype(np.float64).sum(0),
        lambda d, s, b: np.ones(len(d)),
        absolute=5 * FLOAT32_EPS,
    ),
    Check(
        "distance at which a level takes over",
        lambda: [Case(f"scale {s:g}", (s,)) for s in (1e-12, 1e-6, 1.0, 1e6)],
        _switch_distance,
        lambda s: s * 960 / math.tan(math.pi / 6),
        relative=1e-12,
    ),
    Check(
        "cross-fade: -expm1(w log1p(-alpha))",
        _crossfade_cases,
        draw_order.crossfade_opacity,
        _crossfade_reference,
        relative=FLOAT32,
        absolute=1e-12,
    ),
    Check(
        "two equal splats, drawn with w and 1 - w",
        _equal_splat_cases,
        lambda a, w: _composite_twice(draw_order.crossfade_opacity, a, w),
        lambda a, w: a.astype(np.float64),
        relative=FLOAT32,
        absolute=1e-6,
        printed=lambda a, w: _composite_twice(lambda x, y: x * y, a, w),
    ),
    Check(
        "J R S, a Gaussian's shape on a slope", _shape_cases, _drape, _drape_reference, relative=1e-9, absolute=1e-12
    ),
    Check("height and slopes of hills", _place_cases, _hills, _hills_reference, absolute=1e-5),
    Check("which tile lies in a cell", _cell_cases, _hash, _hash_reference),
]
