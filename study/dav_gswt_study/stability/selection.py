"""Checks of the selection of views, and of measures of how well scores predict errors."""

import math
from decimal import Context, Decimal, localcontext
from fractions import Fraction

import numpy as np
from numpy import ndarray as Array

from dav_gswt.views.coverage import compute_gain
from dav_gswt_study.calibration import agreement as calibration
from dav_gswt_study.stability.formula import FLOAT32, Case, Check

SIZES = (1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6)


def _coverage_cases() -> list[Case]:
    rng, cases = np.random.default_rng(0), []
    for known in (0.0, 1.0, 1e3, 1e9):
        for size in SIZES:
            added = rng.exponential(size, (40, 12)).astype(np.float32)
            added[:5] = 0
            cases.append(Case(f"{known:g} pixels known, {size:g} added", (np.full((40, 12), known), added)))
    return cases


def _gain(known: Array, added: Array) -> float:
    return compute_gain(np.ones(len(known)), known, added)


def _gain_reference(known: Array, added: Array) -> float:
    with localcontext(Context(prec=60)):
        pairs = [(Decimal(float(k)), Decimal(float(a))) for k, a in zip(known.flat, added.flat, strict=True)]
        return float(sum(((1 + k + a) / (1 + k)).ln() for k, a in pairs))


def _gain_printed(known: Array, added: Array) -> float:
    """As a difference of logarithms."""
    return float((np.log(1 + known + added) - np.log(1 + known)).sum())


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
    Check(
        "what a photo adds to coverage", _coverage_cases, _gain, _gain_reference, relative=1e-12, printed=_gain_printed
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
