"""Formulas of the terrain: levels and their weights, the surface under it, which tile lies where."""

import math
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.bundle import lod
from dav_gswt.field import GaussianField
from dav_gswt.study.stability.formula import LAW, SINGLE, Formula, Point, Tolerance
from dav_gswt.study.stability.scoring import EXACT
from dav_gswt.terrain import displacement, weights
from dav_gswt.terrain.choice import hash_cell
from dav_gswt.terrain.heights import GAIN, HILLS, SHIFT, Hills

BANDS = (0.0, 1e-12, 1e-3, 1.0, 1e6)
SWITCHES = (2.0**-10, 1.0, 1024.0, 2.0**20)
EYE = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 12, 97)])


def _distances() -> list[Point]:
    found = []
    for switch in SWITCHES:
        near = switch * (1 + np.linspace(-2, 2, 41))
        for band in BANDS:
            d = np.concatenate([EYE, near, switch + band * np.linspace(-1.5, 1.5, 31)]).clip(0).astype(np.float32)
            found.append(Point(f"D {switch:g}, Delta {band:g}, d = ", (d, switch, band), d))
    return found


def _share_slowly(d: Array, switch: float, band: float, smooth: bool = False) -> Array:
    found = []
    for x in d.astype(np.float64):
        if band > 0:
            s = min(max(0.5 - (x - switch) / (2 * band), 0.0), 1.0)
        else:
            s = 1.0 if x < switch else 0.0 if x > switch else 0.5
        found.append(s * s * (3 - 2 * s) if smooth else s)
    return np.array(found)


def _share_printed(d: Array, switch: float, band: float) -> Array:
    """0 outside its band."""
    inside = (switch - band <= d) & (d < switch + band)
    return np.where(inside, np.float32(0.5) - (d - np.float32(switch)) / np.float32(2 * band), np.float32(0))


def _chains() -> list[Point]:
    found = []
    for band in BANDS:
        switches = [1.0, 2.0, 4.0, 1024.0, np.inf]
        found.append(Point(f"five levels, Delta {band:g}, d = ", (EYE.astype(np.float32), switches, [band] * 5), EYE))
    return found


def _fades() -> list[Point]:
    w = np.concatenate([[0.0, 1.0], 10.0 ** np.linspace(-12, 0, 49), 1 - 10.0 ** np.linspace(-7, -1, 13)])
    opaque = np.array([0.0, 1e-12, 1e-6, 1 / 255, 0.5, 0.9, 0.99, 1 - 1e-3, 1 - 1e-5, 1.0])
    return [Point(f"alpha {a:.7g}, w = ", (np.full(len(w), a, np.float32), w.astype(np.float32)), w) for a in opaque]


def _fade_slowly(a: Array, w: Array) -> Array:
    """1 - (1 - alpha)^w of the same arguments, alpha held below 1 - 1e-6."""
    most = float(np.float32(1 - 1e-6))
    found = []
    for x, y in zip(a.astype(np.float64).tolist(), w.astype(np.float64).tolist(), strict=True):
        found.append(x if y == 1 else 0.0 if y == 0 else -math.expm1(y * math.log1p(-min(x, most))))
    return np.array(found)


def _over(fade, a: Array, w: Array) -> Array:
    """Opacity of two equal Gaussians, drawn with w and 1 - w."""
    one = np.ones_like(a)
    return one - (one - fade(a, w)) * (one - fade(a, one - w))


def _halves() -> list[Point]:
    w = np.linspace(0, 1, 33).astype(np.float32)
    return [Point(f"alpha {a:g}, w = ", (np.full(33, a, np.float32), w), w) for a in (1e-6, 0.1, 0.9, 0.99, 0.999)]


def _switch(scale: float) -> float:
    return lod.level_table([0.5 * scale, scale], 1.0, 0.1)[0]["distance"]


def _shapes() -> list[Point]:
    found, rng = [], np.random.default_rng(0)
    quats = rng.standard_normal((40, 4)).astype(np.float32)
    for scales in ((1e-12, 1e-12, 1e-12), (1e6, 1e6, 1e6), (1e6, 1.0, 1.0), (1.0, 1.0, 1e-6), (1e-12, 1.0, 1e6)):
        for steep in (0.0, 1.0, 1e3):
            slope = np.tile(np.array([steep, -0.5 * steep]), (40, 1))
            found.append(Point(f"scales {scales}, slope {steep:g}", (quats, scales, slope)))
    return found


def _draped(quats: Array, scales: tuple, slope: Array) -> Array:
    """The shape A of every Gaussian, each column over its own length: what A A^T is made of."""
    n = len(quats)
    logs = np.tile(np.log(np.array(scales)).astype(np.float32), (n, 1))
    zero = np.zeros(n, np.float32)
    field = GaussianField(
        np.zeros((n, 3), np.float32), logs, quats, zero, np.zeros((n, 1, 3), np.float32), zero, zero > 0
    )
    return displacement.displaced_axes(field, slope) / np.exp(logs.astype(np.float64))[:, None]


def _draped_slowly(quats: Array, scales: tuple, slope: Array) -> Array:
    found = []
    for q, (east, north) in zip(quats.astype(np.float64), slope, strict=True):
        w, x, y, z = q / math.sqrt(sum(v * v for v in q))
        turn = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        found.append(np.array([[1, 0, 0], [0, 1, 0], [east, north, 1]]) @ turn)
    return np.array(found)


def _places() -> list[Point]:
    found, rng = [], np.random.default_rng(0)
    for far in (0.0, 1e3, 1e6, 1e9):
        x, y = (np.floor(far + rng.uniform(0, 64, 24)) + rng.integers(0, 64, 24) / 64 for _ in range(2))
        found.append(Point(f"{far:g} units from the origin", (x, y)))
    return found


def _surface(x: Array, y: Array) -> Array:
    height, slope = Hills(2.0, 8.0, 4, 3).at(x, y)
    return np.column_stack([height, slope])


def _surface_slowly(x: Array, y: Array) -> Array:
    """Height and slopes in whole fractions: no cell is missed however far out."""
    shares = [GAIN**k for k in range(4)]
    found = []
    for at in zip(x.tolist(), y.tolist(), strict=True):
        parts = [
            np.array(_octave(k, *(Fraction(v) * 2**k / 8 + k * Fraction(s) for v, s in zip(at, SHIFT, strict=True))))
            for k in range(4)
        ]
        total = sum(
            2.0 * a / sum(shares) * p * [1, 2**k / 8, 2**k / 8]
            for k, (a, p) in enumerate(zip(shares, parts, strict=True))
        )
        found.append(total)
    return np.array(found)


def _octave(k: int, x: Fraction, y: Fraction) -> tuple[float, float, float]:
    i, j = math.floor(x), math.floor(y)
    u, v = x - i, y - j

    def fade(t: Fraction) -> tuple[Fraction, Fraction]:
        return t**3 * (t * (6 * t - 15) + 10), 30 * t * t * (t * (t - 2) + 1)

    value = by_x = by_y = Fraction(0)
    for a in (0, 1):
        for b in (0, 1):
            bits = hash_cell(i + a, j + b, HILLS + k, 3)
            east, north = Fraction(bits & 0xFFFF) / Fraction(32767.5) - 1, Fraction(bits >> 16) / Fraction(32767.5) - 1
            (fx, tx), (fy, ty) = fade(u), fade(v)
            (fx, tx), (fy, ty) = (fx, tx) if a else (1 - fx, -tx), (fy, ty) if b else (1 - fy, -ty)
            plane = east * (u - a) + north * (v - b)
            value += fx * fy * plane
            by_x += fx * fy * east + tx * fy * plane
            by_y += fx * fy * north + fx * ty * plane
    return float(value), float(by_x), float(by_y)


def _numbers() -> list[Point]:
    edge = [0, 1, -1, 2**31 - 1, -(2**31), 2**32, 2**53, -(2**53), 2**62, -(2**63)]
    i, j = (a.ravel() for a in np.meshgrid(np.array(edge, np.int64), np.array(edge, np.int64)))
    return [Point(f"salt {salt}, i = ", (i, j, salt), i) for salt in (0, 1, 2**32 - 1)]


def _hash(i: Array, j: Array, salt: int) -> Array:
    with np.errstate(over="ignore"):
        return hash_cell(i, j, 2, salt).astype(np.float64)


def _hash_slowly(i: Array, j: Array, salt: int) -> Array:
    """In whole numbers without end."""
    found = []
    for a, b in zip(i.tolist(), j.tolist(), strict=True):
        h = (a * 0x8DA6B343 ^ b * 0xD8163841 ^ 2 * 0xCB1AB31F ^ salt) % 2**32
        h = (h ^ h >> 16) * 0x85EBCA6B % 2**32
        h = (h ^ h >> 13) * 0xC2B2AE35 % 2**32
        found.append(h ^ h >> 16)
    return np.array(found, np.float64)


ALPHA, FADE, PLACE = "LOD alpha", "cross-fade of opacity", "surface and tiles"
FORMULAS = [
    Formula(
        ALPHA,
        "LOD alpha: clip(1/2 - (d - D) / (2 Delta), 0, 1)",
        "Eq. (lod_blend)",
        "d 0 to 1e12, D 1e-3 to 1e6, Delta 0, 1e-12 to 1e6",
        "float32",
        _distances,
        weights.finer_share,
        _share_slowly,
        Tolerance(LAW[0], 1e-6, LAW[1]),
        _share_printed,
    ),
    Formula(
        ALPHA,
        "LOD alpha, smooth",
        "Eq. (lod_blend)",
        "the same",
        "float32",
        _distances,
        lambda d, switch, band: weights.finer_share(d, switch, band, True),
        lambda d, switch, band: _share_slowly(d, switch, band, True),
        Tolerance(LAW[0], 1e-6, LAW[1]),
    ),
    Formula(
        ALPHA,
        "LOD: weights of all levels sum to 1",
        "Eq. (lod_blend)",
        "five levels, bands that overlap",
        "float32",
        _chains,
        lambda d, s, b: weights.level_weights(d, s, b).astype(np.float64).sum(0),
        lambda d, s, b: np.ones(len(d)),
        Tolerance(0.0, 5 * SINGLE, "a rounding of float32 a level"),
    ),
    Formula(
        ALPHA,
        "distance at which a level takes over",
        "docs/research/numerics.md",
        "scales 1e-12 to 1e6",
        "float64",
        lambda: [Point(f"scale {s:g}", (s,)) for s in (1e-12, 1e-6, 1.0, 1e6)],
        _switch,
        lambda s: s * 960 / math.tan(math.pi / 6),
        Tolerance(1e-12, 0.0, "roundings of float64"),
    ),
    Formula(
        FADE,
        "cross-fade: -expm1(w log1p(-alpha))",
        "Eq. (lod_blend)",
        "alpha 0 to 1, w 0 and 1e-12 to 1",
        "float32",
        _fades,
        weights.crossfade_opacity,
        _fade_slowly,
        Tolerance(LAW[0], 1e-12, LAW[1]),
    ),
    Formula(
        FADE,
        "two equal splats, drawn with w and 1 - w",
        "linear in the paper",
        "alpha 1e-6 to 0.999, w 0 to 1",
        "float32",
        _halves,
        lambda a, w: _over(weights.crossfade_opacity, a, w),
        lambda a, w: a.astype(np.float64),
        Tolerance(LAW[0], 1e-6, LAW[1]),
        lambda a, w: _over(lambda x, y: x * y, a, w),
    ),
    Formula(
        PLACE,
        "J R S, a Gaussian's shape on a slope",
        "height fields",
        "scales 1e-12 to 1e6, needles, slopes to 1000",
        "float64",
        _shapes,
        _draped,
        _draped_slowly,
        Tolerance(1e-9, 1e-12, "roundings of float64 times the slope"),
    ),
    Formula(
        PLACE,
        "height and slopes of hills",
        "height fields",
        "to 1e9 units from the origin",
        "float64",
        _places,
        _surface,
        _surface_slowly,
        Tolerance(0.0, 1e-5, "1e9 units hold 1e-7 of a unit; the steepest hill is 3"),
    ),
    Formula(
        PLACE,
        "which tile lies in a cell",
        "integer hash",
        "cells to 2^63, every salt",
        "integer",
        _numbers,
        _hash,
        _hash_slowly,
        EXACT,
    ),
]
