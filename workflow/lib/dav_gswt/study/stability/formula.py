"""A formula beside its float64 reference, and how far the two are apart over its whole range."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

SINGLE = float(np.finfo(np.float32).eps)  # 1.2e-7, twice the largest rounding of a float32
LAW = 1e-5, "float32 against float64 (docs/research/numerics.md)"  # a tolerance, and where it comes from


@dataclass(frozen=True)
class Point:
    """Arguments of a formula. at: what is said of them. along: a value for each number that comes out, to name it."""

    at: str
    arguments: tuple
    along: Array | None = None


@dataclass(frozen=True)
class Tolerance:
    """|found - wanted| may be absolute + relative |wanted|. why: where that comes from."""

    relative: float
    absolute: float
    why: str


@dataclass(frozen=True)
class Formula:
    """One formula. item: its row in the table of numerics. domain: over which range. kind: the type it is computed or
    stored in. ours: the project's own function. printed: the paper's form where it differs, in float32."""

    item: str
    name: str
    source: str
    domain: str
    kind: str
    points: Callable[[], list[Point]]
    ours: Callable
    reference: Callable
    tolerance: Tolerance
    printed: Callable | None = None


@dataclass(frozen=True)
class Error:
    """The worst of all points: largest absolute error; largest relative one, of values above the absolute tolerance;
    largest share of the tolerance (above 1 it is exceeded), where that is, what was found and wanted there."""

    absolute: float
    relative: float
    share: float
    at: str
    found: float
    wanted: float
    finite: bool


def error(formula: Formula, function: Callable) -> Error:
    """How far a function is from the formula's reference. What is not finite is infinitely far off."""
    parts = [_at(point, formula, function) for point in formula.points()]
    worst = max(parts, key=lambda part: part.share)
    return Error(
        max(part.absolute for part in parts),
        max(part.relative for part in parts),
        worst.share,
        worst.at,
        worst.found,
        worst.wanted,
        all(part.finite for part in parts),
    )


def _at(point: Point, formula: Formula, function: Callable) -> Error:
    with np.errstate(all="ignore"):
        found = np.asarray(function(*point.arguments), np.float64)
        wanted = np.asarray(formula.reference(*point.arguments), np.float64)
        found, wanted = (a.ravel() for a in np.broadcast_arrays(found, wanted))
        apart = np.where(found == wanted, 0.0, np.abs(found - wanted))
        apart = np.where(np.isnan(apart), np.inf, apart)
        told = np.abs(wanted) > formula.tolerance.absolute
        relative = _over(apart, np.where(told, np.abs(wanted), 0.0))
        share = _over(apart, formula.tolerance.absolute + formula.tolerance.relative * np.abs(wanted), np.inf)
    i = int(np.argmax(share))
    at = point.at if point.along is None else f"{point.at}{float(np.ravel(point.along)[i]):.4g}"
    finite = bool(np.isfinite(found).all())
    return Error(
        float(apart.max()), float(relative.max()), float(share[i]), at, found[i].item(), wanted[i].item(), finite
    )


def _over(apart: Float64[Array, "n"], size: Float64[Array, "n"], without: float = 0.0) -> Float64[Array, "n"]:
    """Errors over what they are measured by; no error is 0, any over nothing `without`."""
    return np.where(apart == 0, 0.0, np.where(size > 0, apart / np.where(size > 0, size, 1), without))


def row(formula: Formula) -> dict:
    """The formula's row of the table. Of the printed form the worst error by the same tolerance, and what it gives."""
    ours = error(formula, formula.ours)
    printed = error(formula, formula.printed) if formula.printed else None
    return {
        "item": formula.item,
        "formula": formula.name,
        "source": formula.source,
        "range": formula.domain,
        "type": formula.kind,
        "finite": ours.finite,
        "absolute_error": ours.absolute,
        "relative_error": ours.relative,
        "worst_at": ours.at,
        "tolerance_relative": formula.tolerance.relative,
        "tolerance_absolute": formula.tolerance.absolute,
        "tolerance_from": formula.tolerance.why,
        "share_of_tolerance": ours.share,
        "printed_absolute_error": printed and printed.absolute,
        "printed_relative_error": printed and printed.relative,
        "printed_share_of_tolerance": printed and printed.share,
        "printed_at": printed and printed.at,
        "printed_gives": printed and f"{printed.found:.9g}",
        "printed_right": printed and f"{printed.wanted:.9g}",
        "printed_finite": printed and printed.finite,
    }
