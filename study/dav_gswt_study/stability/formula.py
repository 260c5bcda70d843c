"""Compare a formula with its float64 reference over its whole range."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

FLOAT32_EPS = float(np.finfo(np.float32).eps)  # 1.2e-7, twice the largest rounding of a float32
FLOAT32 = 1e-5  # tolerance of a float32 kernel against float64


@dataclass(frozen=True)
class Case:
    """Arguments of a formula. label: what is special about them. along: a value for each output, to name it."""

    label: str
    arguments: tuple
    along: Array | None = None


@dataclass(frozen=True)
class Check:
    """One formula of `formulas.csv`, by its name there.

    compute: the project's own function. reference: a slow implementation in float64. printed: the paper's form in
    float32, where it differs. |computed - expected| may be `absolute` + `relative` |expected|; by default 0, exact.
    """

    name: str
    cases: Callable[[], list[Case]]
    compute: Callable
    reference: Callable
    relative: float = 0.0
    absolute: float = 0.0
    printed: Callable | None = None


@dataclass(frozen=True)
class WorstError:
    """The largest errors over all cases.

    absolute, relative: the latter of values above the absolute tolerance. share: the largest share of the tolerance,
    above 1 it is exceeded; label, computed, expected: where that is.
    """

    absolute: float
    relative: float
    share: float
    label: str
    computed: float
    expected: float
    finite: bool


def measure_error(check: Check, function: Callable) -> WorstError:
    """Error of a function against the check's reference. A value that is not finite is infinitely far off."""
    parts = [_measure_case(case, check, function) for case in check.cases()]
    worst = max(parts, key=lambda part: part.share)
    absolute, relative = (max(getattr(part, name) for part in parts) for name in ("absolute", "relative"))
    return replace(worst, absolute=absolute, relative=relative, finite=all(part.finite for part in parts))


def _measure_case(case: Case, check: Check, function: Callable) -> WorstError:
    with np.errstate(all="ignore"):
        computed = np.asarray(function(*case.arguments), np.float64)
        expected = np.asarray(check.reference(*case.arguments), np.float64)
        computed, expected = (a.ravel() for a in np.broadcast_arrays(computed, expected))
        error = np.where(computed == expected, 0.0, np.abs(computed - expected))
        error = np.where(np.isnan(error), np.inf, error)
        large = np.abs(expected) > check.absolute
        relative = _divide(error, np.where(large, np.abs(expected), 0.0))
        share = _divide(error, check.absolute + check.relative * np.abs(expected), np.inf)
    i = int(np.argmax(share))
    label = case.label if case.along is None else f"{case.label}{float(np.ravel(case.along)[i]):.4g}"
    worst = float(error.max()), float(relative.max()), float(share[i])
    return WorstError(*worst, label, computed[i].item(), expected[i].item(), bool(np.isfinite(computed).all()))


def _divide(error: Float64[Array, "n"], size: Float64[Array, "n"], over_zero: float = 0.0) -> Float64[Array, "n"]:
    """Errors over sizes; 0 where there is no error, `over_zero` where only the size is 0."""
    return np.where(error == 0, 0.0, np.where(size > 0, error / np.where(size > 0, size, 1), over_zero))
