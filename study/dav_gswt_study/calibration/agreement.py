"""Agreement of scores with the true error of the field.

Measures: rank correlation, sparsification error, and split-conformal intervals.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array

from dav_gswt.views.uncertainty import require_finite

LEAST = 0.1  # least unit of an interval's width, in mean expected errors
LEVEL = 0.9  # of the intervals
LEAST_POSES = 8  # poses needed for a result
SPLITS = 200  # random halves of the poses over which coverage is averaged

Judgement = dict[str, float | None]


def spearman(u: Float[Array, "n"], error: Float[Array, "n"]) -> float | None:
    """Rank correlation of a score with the true error, ties by their mean rank; None if one of them is constant.

    Raises: ValueError: a value that is not finite.
    """
    from scipy.stats import spearmanr  # slow to load

    u, error = _check_finite(u, error)
    if len(u) < 2 or np.ptp(u) == 0 or np.ptp(error) == 0:
        return None
    return float(spearmanr(u, error).statistic)


def ause(u: Float[Array, "n"], error: Float[Array, "n"]) -> float:
    """Area under the sparsification error: 0 if the score orders samples as the true error does; smaller is better.

    s(f) is the mean error without the most uncertain share f of the samples, over that of all; the oracle's curve
    leaves out by true error. AUSE is the integral over f from 0 to (n - 1) / n of their difference, by the trapezoidal
    rule. Samples of equal score count with their mean error. 0 if all errors are 0.
    Raises: ValueError: no sample, a value that is not finite, an error below 0.
    Source: Ilg et al., Uncertainty estimates and multi-hypotheses networks for optical flow, ECCV 2018.
    """
    u, error = _check_finite(u, error)
    if not len(u) or error.min() < 0:
        raise ValueError("sparsification needs samples, with errors of at least 0")
    if error.max() == 0 or len(u) == 1:
        return 0.0
    scaled = error / error.max()  # so that no sum leaves the range
    return float(np.trapezoid(_sparsification_curve(u, scaled) - _sparsification_curve(scaled, scaled), dx=1 / len(u)))


def _sparsification_curve(by: Float64[Array, "n"], error: Float64[Array, "n"]) -> Float64[Array, "n"]:
    """Relative mean error of the rest when 0, 1, ... n - 1 samples of the largest `by` are left out."""
    _, group = np.unique(by, return_inverse=True)
    alike = np.bincount(group, error) / np.bincount(group)
    rising = alike[np.sort(group)]
    left = np.cumsum(rising)[::-1] / np.arange(len(by), 0, -1)
    return left / left[0]


@dataclass(frozen=True)
class Intervals:
    """Split-conformal intervals of |error| against u. expected: |error| at the knots u, rising, linear between them.

    half_width: of the interval, in `unit`s; infinite if there were too few samples for the level.
    """

    u: Float64[Array, "k"]
    expected: Float64[Array, "k"]
    half_width: float
    level: float

    def bounds(self, u: Float[Array, "n"]) -> tuple[Float64[Array, "n"], Float64[Array, "n"]]:
        """Ends of the intervals, not below 0, that contain |error| with at least the probability `level`.

        This holds on average over samples exchangeable with those of the calibration, for any u.
        """
        middle = np.interp(u, self.u, self.expected)
        wide = self.half_width * self.unit(middle)
        return np.maximum(middle - wide, 0), middle + wide

    def unit(self, middle: Float64[Array, "n"]) -> Float64[Array, "n"]:
        """Unit of deviations: the expected error, bounded from below; 1 if no error is expected."""
        return np.maximum(middle, LEAST * float(self.expected.mean()) or 1.0)


def calibrate_intervals(
    u: Float[Array, "n"], error: Float[Array, "n"], rng: np.random.Generator, level: float = LEVEL
) -> Intervals:
    """Calibrate intervals on held-out samples: one random half fits the expected |error| at u, the other its spread.

    Raises: ValueError: fewer than 2 samples, a level outside (0, 1), a value that is not finite.
    """
    from scipy.optimize import isotonic_regression

    u, error = _check_finite(u, np.abs(error))
    if len(u) < 2:
        raise ValueError(f"calibration needs at least 2 samples, not {len(u)}")
    order = rng.permutation(len(u))
    fit, rest = order[: len(u) // 2], order[len(u) // 2 :]
    knots, group = np.unique(u[fit], return_inverse=True)
    count = np.bincount(group)
    expected = isotonic_regression(np.bincount(group, error[fit]) / count, weights=count).x
    rough = Intervals(knots, expected, 0.0, level)
    middle = np.interp(u[rest], knots, expected)
    deviations = np.abs(error[rest] - middle) / rough.unit(middle)
    return Intervals(knots, expected, conformal_quantile(deviations, level), level)


def conformal_quantile(deviations: Float[Array, "n"], level: float) -> float:
    """The ceil((n + 1) level)-th smallest of n deviations; infinite if that rank exceeds n.

    One more exchangeable deviation is at most this with at least the probability `level`.

    Raises: ValueError: a level outside (0, 1).
    """
    if not 0 < level < 1:
        raise ValueError(f"the level of an interval lies between 0 and 1, not at {level}")
    rank = ceil((len(deviations) + 1) * Fraction(repr(float(level))))  # as written: 0.9 is nine tenths
    return float(np.sort(deviations)[rank - 1]) if rank <= len(deviations) else np.inf


def _check_finite(u: Float[Array, "n"], error: Float[Array, "n"]) -> tuple[Float64[Array, "n"], Float64[Array, "n"]]:
    require_finite(u, "the score")
    require_finite(error, "the error")
    return u.astype(np.float64), error.astype(np.float64)


def evaluate_scores(scores: dict[str, Float[Array, "n"]], error: Float[Array, "n"], seed: int) -> dict[str, Judgement]:
    """Of each score of n poses: `spearman`, `ause`, and `coverage` and mean `width` of split-conformal intervals.

    `ause_chance` is the AUSE of a score that says nothing. Intervals are calibrated on a random half of the poses and
    tried on the other, SPLITS times, by the same halves for every score. They are None where a half has too few poses
    for LEVEL (fewer than 34). All is None of fewer than LEAST_POSES, or where score or error is constant.
    Raises: ValueError: a value that is not finite.
    """
    found = {}
    for name, score in scores.items():
        found[name] = dict.fromkeys(("spearman", "ause", "ause_chance", "coverage", "width"))
        if len(error) >= LEAST_POSES and (rank := spearman(score, error)) is not None:
            coverage, width = _intervals(score, error, seed)
            areas = {"ause": ause(score, error), "ause_chance": ause(np.zeros(len(error)), error)}
            found[name] = {"spearman": rank, **areas, "coverage": coverage, "width": width}
    return found


def _intervals(score: Float[Array, "n"], error: Float[Array, "n"], seed: int) -> tuple[float | None, float | None]:
    """How many of the poses left out lie in their intervals, and how wide these are, in units of the error."""
    inside, width = [], []
    for split in range(SPLITS):
        rng = np.random.default_rng([seed, split])
        order = rng.permutation(len(error))
        one, other = order[: len(error) // 2], order[len(error) // 2 :]
        low, high = calibrate_intervals(score[one], error[one], rng).bounds(score[other])
        inside.append(((low <= error[other]) & (error[other] <= high)).mean())
        width.append((high - low).mean())
    if not np.isfinite(width).all():
        return None, None
    return float(np.mean(inside)), float(np.mean(width))


def summarise(scores: dict[str, Float[Array, "n"]], error: Float[Array, "n"], seed: int) -> dict:
    """The content of calibration.json, of the poses whose error is known."""
    seen = np.flatnonzero(~np.isnan(error))
    return {
        "poses": len(seen),
        "error_mean": float(error[seen].mean()) if len(seen) else None,
        "level": LEVEL,
        "scores": evaluate_scores({name: score[seen] for name, score in scores.items()}, error[seen], seed),
    }
