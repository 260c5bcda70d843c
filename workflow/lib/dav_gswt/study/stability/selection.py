"""Checks of the selection of views, and of measures of how well scores predict errors."""

import math
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.study.stability.formula import FLOAT32, Case, Check
from dav_gswt.views import facility_location
from dav_gswt.views.uncertainty import calibration

SIZES = (1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6)


def _pose_cases() -> list[Case]:
    rng, cases = np.random.default_rng(0), []
    at = rng.standard_normal((30, 3))
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    at[15:] = at[:15] + 1e-6 * rng.standard_normal((15, 3))  # as good as duplicates
    at[20] = at[5]
    for size in SIZES:
        u = np.abs(rng.standard_normal(30)) * size
        cases.append(Case(f"poses {size:g} away, uncertainty of {size:g}", ((at * size).astype(np.float32), u)))
    return cases


def _similarity(places: Array, u: Array) -> Array:
    return facility_location.similarity(places, places, facility_location.kernel_width(places))


def _similarity_reference(places: Array, u: Array) -> Array:
    at = places.astype(np.float64)
    reach = 0.5 * np.median(np.sqrt((at**2).sum(1)))
    return np.exp(-((at[:, None] - at[None]) ** 2).sum(-1) / (2 * reach**2))


def _gains(places: Array, u: Array) -> Array:
    """Gain of each pose over the first ten, divided by the sum of weights."""
    near = _similarity(places, u)
    return (
        facility_location.coverage_gains(near.astype(np.float64), near[:, :10].max(1).astype(np.float64), u) / u.sum()
    )


def _gains_reference(places: Array, u: Array) -> Array:
    near = _similarity_reference(places, u)
    covered = near[:, :10].max(1)
    return np.array([sum(u[v] * max(near[v, s] - covered[v], 0) for v in range(30)) for s in range(30)]) / u.sum()


def _rank_cases() -> list[Case]:
    levels = ("0.9", "0.95", "0.5", "0.7", "0.07", "0.99", "0.999999")
    return [
        Case(f"level {level}, n = ", (n, level), np.array([n])) for level in levels for n in (9, 29, 99, 999, 99999)
    ]


def _rank(n: int, level: str) -> float:
    """The rank of the quantile among n residuals; n + 1 stands for infinity."""
    return min(calibration.conformal_quantile(np.arange(1.0, n + 1), float(level)), n + 1.0)


def _rank_reference(n: int, level: str) -> float:
    return float(min(math.ceil((n + 1) * Fraction(level)), n + 1))


def _rank_printed(n: int, level: str) -> float:
    """The rank by a product of floats."""
    return float(min(math.ceil((n + 1) * float(level)), n + 1))


def _error_cases() -> list[Case]:
    rng = np.random.default_rng(0)
    u, error = rng.uniform(0, 1, 60).astype(np.float32), rng.exponential(size=60).astype(np.float32)
    u[10:20] = u[10]
    sizes = (1e-30, *SIZES, 1e30)
    return [Case(f"errors of {s:g}", (u, error * np.float32(s))) for s in sizes] + [
        Case("errors of 0", (u, 0 * error)), Case("a constant score", (0 * u, error))
    ]  # fmt: skip


def _ause_reference(u: Array, error: Array) -> float:
    """By its definition; equal scores share the mean of their errors."""
    u, error = u.astype(np.float64), error.astype(np.float64)
    if error.max() == 0:
        return 0.0

    def curve(by: Array) -> Array:
        tied = np.array([error[by == b].mean() for b in by])[np.argsort(by, kind="stable")]
        left = np.array([tied[: len(by) - k].mean() for k in range(len(by))])
        return left / left[0]

    apart = curve(u) - curve(error)
    return float(sum((apart[k] + apart[k + 1]) / 2 for k in range(len(u) - 1)) / len(u))


def _spearman(u: Array, error: Array) -> float:
    cases = calibration.spearman(u, error)
    return 2.0 if cases is None else cases  # 2 stands for an undefined correlation


def _spearman_reference(u: Array, error: Array) -> float:
    if np.ptp(u) == 0 or np.ptp(error) == 0:
        return 2.0
    a, b = ([((v < x).sum() + ((v == x).sum() + 1) / 2) for x in v] for v in (u, error))
    return float(np.corrcoef(a, b)[0, 1])


CHECKS = [
    Check("similarity of two poses", _pose_cases, _similarity, _similarity_reference, relative=FLOAT32, absolute=1e-5),
    Check(
        "what a pose adds, duplicates included", _pose_cases, _gains, _gains_reference, relative=FLOAT32, absolute=1e-5
    ),
    Check("rank of a conformal interval", _rank_cases, _rank, _rank_reference, printed=_rank_printed),
    Check(
        "area under the sparsification error",
        _error_cases,
        calibration.ause,
        _ause_reference,
        relative=FLOAT32,
        absolute=1e-9,
    ),
    Check("Spearman's rank correlation", _error_cases, _spearman, _spearman_reference, relative=FLOAT32, absolute=1e-9),
]
