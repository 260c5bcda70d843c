"""Checks of the terrain: weights of levels, cross-fades, places in exported files."""

import math
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.terrain import draw_order, heights
from dav_gswt.terrain.heights import FlatSurface
from dav_gswt_study.stability.formula import FLOAT32, FLOAT32_EPS, Case, Check

BANDS = (0.0, 1e-12, 1e-3, 1.0, 1e6)
SWITCHES = (2.0**-10, 1.0, 1024.0, 2.0**20)
EYE = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 12, 97)])
SIDE = 0.7  # of a tile whose positions are exported, in units


def _distance_cases() -> list[Case]:
    cases = []
    for switch in SWITCHES:
        near = switch * (1 + np.linspace(-2, 2, 41))
        for band in BANDS:
            d = np.concatenate([EYE, near, switch + band * np.linspace(-1.5, 1.5, 31)]).clip(0).astype(np.float32)
            cases.append(Case(f"D {switch:g}, Delta {band:g}, d = ", (d, switch, band), d))
    return cases


def _alpha_reference(d: Array, switch: float, band: float) -> Array:
    cases = []
    for x in d.astype(np.float64):
        if band > 0:
            s = min(max(0.5 - (x - switch) / (2 * band), 0.0), 1.0)
        else:
            s = 1.0 if x < switch else 0.0 if x > switch else 0.5
        cases.append(s)
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
        "LOD: weights of all levels sum to 1",
        _level_cases,
        lambda d, s, b: draw_order.level_weights(d, s, b).astype(np.float64).sum(0),
        lambda d, s, b: np.ones(len(d)),
        absolute=5 * FLOAT32_EPS,
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
        "a place in an exported file",
        _export_cases,
        _export,
        _export_reference,
        relative=FLOAT32_EPS,
        absolute=1e-6,
        printed=_export_naive,
    ),
]
