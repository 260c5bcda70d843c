"""Formulas of choosing views, and of judging whether scores are right."""

import math
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.study.stability.formula import LAW, Formula, Point, Tolerance
from dav_gswt.study.stability.scoring import EXACT
from dav_gswt.views import facility_location
from dav_gswt.views.uncertainty import calibration

SIZES = (1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6)


def _poses() -> list[Point]:
    rng, found = np.random.default_rng(0), []
    at = rng.standard_normal((30, 3))
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    at[15:] = at[:15] + 1e-6 * rng.standard_normal((15, 3))  # as good as duplicates
    at[20] = at[5]
    for size in SIZES:
        u = np.abs(rng.standard_normal(30)) * size
        found.append(Point(f"poses {size:g} away, doubt of {size:g}", ((at * size).astype(np.float32), u)))
    return found


def _alike(places: Array, u: Array) -> Array:
    return facility_location.similarity(places, places, facility_location.kernel_width(places))


def _alike_slowly(places: Array, u: Array) -> Array:
    at = places.astype(np.float64)
    reach = 0.5 * np.median(np.sqrt((at**2).sum(1)))
    return np.exp(-((at[:, None] - at[None]) ** 2).sum(-1) / (2 * reach**2))


def _gains(places: Array, u: Array) -> Array:
    """Over the sum of the weights: what each pose adds to the first ten."""
    near = _alike(places, u)
    return (
        facility_location.coverage_gains(near.astype(np.float64), near[:, :10].max(1).astype(np.float64), u) / u.sum()
    )


def _gains_slowly(places: Array, u: Array) -> Array:
    near = _alike_slowly(places, u)
    covered = near[:, :10].max(1)
    return np.array([sum(u[v] * max(near[v, s] - covered[v], 0) for v in range(30)) for s in range(30)]) / u.sum()


def _ranks() -> list[Point]:
    levels = ("0.9", "0.95", "0.5", "0.7", "0.07", "0.99", "0.999999")
    return [
        Point(f"level {level}, n = ", (n, level), np.array([n])) for level in levels for n in (9, 29, 99, 999, 99999)
    ]


def _rank(n: int, level: str) -> float:
    """The rank that is taken: of strays 1 to n; n + 1 stands for infinity."""
    return min(calibration.conformal_quantile(np.arange(1.0, n + 1), float(level)), n + 1.0)


def _rank_slowly(n: int, level: str) -> float:
    return float(min(math.ceil((n + 1) * Fraction(level)), n + 1))


def _rank_printed(n: int, level: str) -> float:
    """The rank by floating multiplication."""
    return float(min(math.ceil((n + 1) * float(level)), n + 1))


def _errors() -> list[Point]:
    rng = np.random.default_rng(0)
    u, error = rng.uniform(0, 1, 60).astype(np.float32), rng.exponential(size=60).astype(np.float32)
    u[10:20] = u[10]
    sizes = (1e-30, *SIZES, 1e30)
    return [Point(f"errors of {s:g}", (u, error * np.float32(s))) for s in sizes] + [
        Point("errors of 0", (u, 0 * error)), Point("a score alike everywhere", (0 * u, error))
    ]  # fmt: skip


def _ause_slowly(u: Array, error: Array) -> float:
    """By its definition; equal scores count with the mean of their equals."""
    u, error = u.astype(np.float64), error.astype(np.float64)
    if error.max() == 0:
        return 0.0

    def curve(by: Array) -> Array:
        alike = np.array([error[by == b].mean() for b in by])[np.argsort(by, kind="stable")]
        left = np.array([alike[: len(by) - k].mean() for k in range(len(by))])
        return left / left[0]

    apart = curve(u) - curve(error)
    return float(sum((apart[k] + apart[k + 1]) / 2 for k in range(len(u) - 1)) / len(u))


def _spearman(u: Array, error: Array) -> float:
    found = calibration.spearman(u, error)
    return 2.0 if found is None else found  # 2 stands for: there is none


def _spearman_slowly(u: Array, error: Array) -> float:
    if np.ptp(u) == 0 or np.ptp(error) == 0:
        return 2.0
    a, b = ([((v < x).sum() + ((v == x).sum() + 1) / 2) for x in v] for v in (u, error))
    return float(np.corrcoef(a, b)[0, 1])


FORMULAS = [
    Formula(
        "selection",
        "similarity of two poses",
        "facility location",
        "poses 1e-12 to 1e6 away, a millionth apart",
        "float32",
        _poses,
        _alike,
        _alike_slowly,
        Tolerance(LAW[0], 1e-5, LAW[1]),
    ),
    Formula(
        "selection",
        "what a pose adds, duplicates included",
        "facility location",
        "the same",
        "float32",
        _poses,
        _gains,
        _gains_slowly,
        Tolerance(LAW[0], 1e-5, LAW[1]),
    ),
    Formula(
        'error "bound"',
        "rank of a conformal interval",
        "split conformal",
        "levels 0.07 to 0.999999, 9 to 99999 samples",
        "integer",
        _ranks,
        _rank,
        _rank_slowly,
        EXACT,
        _rank_printed,
    ),
    Formula(
        '"u grows with error", "error never rises"',
        "area under the sparsification error",
        "Ilg et al. 2018",
        "errors 0 and 1e-30 to 1e30, ties",
        "float32",
        _errors,
        calibration.ause,
        _ause_slowly,
        Tolerance(LAW[0], 1e-9, LAW[1]),
    ),
    Formula(
        '"u grows with error", "error never rises"',
        "Spearman's rank correlation",
        "Spearman 1904",
        "the same",
        "float32",
        _errors,
        _spearman,
        _spearman_slowly,
        Tolerance(LAW[0], 1e-9, LAW[1]),
    ),
]
