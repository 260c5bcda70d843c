"""Combination of uncertainty terms, each divided by a scale fixed in the first round; Quantiles map a sum to [0, 1].

Only raw terms are stored; lam enters when poses are selected, so that a sweep over lam shares the scoring.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.views.uncertainty.finite import reject_poses, require_finite

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Scales:
    """Divisor of each term of a scene, fixed in the first round. 0: the term was 0 everywhere, and has no weight."""

    by_term: dict[str, float]

    def __post_init__(self):
        if bad := [name for name, scale in self.by_term.items() if not 0 <= scale < np.inf]:
            raise ValueError(f"the scale of {', '.join(bad)} is not a number of at least 0")

    @staticmethod
    def from_terms(terms: Mapping[str, Float[Array, "n"]], names: Sequence[str] | None = None) -> "Scales":
        """Compute robust scales of the terms of all candidates. A term that is 0 everywhere is logged.

        Raises: ValueError: a value that is not finite, naming the poses.
        """
        for name, values in terms.items():
            require_finite(values, name, names)
        scales = Scales({name: robust_scale(values) for name, values in terms.items()})
        for name in (n for n, scale in scales.by_term.items() if scale == 0):
            _log.warning("%s is 0 at every candidate: the term has no weight", name)
        return scales


@dataclass(frozen=True)
class Quantiles:
    """Uncertainties that are mapped to 0 and 1, fixed in the first round."""

    low: float
    high: float

    def __post_init__(self):
        if not self.low <= self.high:
            raise ValueError(f"the low quantile {self.low} is not below the high one {self.high}")

    @staticmethod
    def from_values(u: Float[Array, "n"], low: float = 0.05, high: float = 0.95) -> "Quantiles":
        """Quantiles of all candidates' uncertainties. Raises: ValueError: no value, or one that is not finite."""
        if not len(u):
            raise ValueError("quantiles need at least one value")
        require_finite(u, "the uncertainty")
        return Quantiles(*(float(q) for q in np.quantile(u.astype(np.float64), [low, high])))


def robust_scale(values: Float[Array, "n"]) -> float:
    """Median absolute value of the values that are not 0; 0 if all are.

    Zeros are excluded since a term can be exactly 0 at most poses, where all samples agree.
    """
    size = np.abs(values.astype(np.float64))
    return float(np.median(size[size > 0])) if (size > 0).any() else 0.0


def combine_terms(
    w2: Float[Array, "n"],
    lpips: Float[Array, "n"] | None,
    lam: float,
    scales: Scales,
    names: Sequence[str] | None = None,
) -> Float64[Array, "n"]:
    """u = W2² + lam LPIPS, each over its frozen scale (`w2_sq`, `lpips`). lpips: None where its weights are missing.

    lam = 0 ranks by W2, a large lam by LPIPS; the units of the latent space do not matter. Without LPIPS its term is
    left out, with a warning if lam > 0.
    Raises: ValueError: lam below 0 or not finite; a term without scale; a value that is not finite, naming the poses.
    Source: DAV-GSWT, Eq. (uncert_latent).
    """
    return _weighted_sum("w2_sq", w2, lpips, lam, scales, names)


def combine_image_terms(
    gradient: Float[Array, "n"],
    lpips: Float[Array, "n"] | None,
    lam: float,
    scales: Scales,
    names: Sequence[str] | None = None,
) -> Float64[Array, "n"]:
    """u_img, an ablation: as `combine_terms`, with the picture's gradient (scale `gradient`) in place of W2.

    The appendix's aggregate of both is their sum. Source: DAV-GSWT, Eq. (uncert_img).
    """
    return _weighted_sum("gradient", gradient, lpips, lam, scales, names)


def _weighted_sum(name: str, first, lpips, lam: float, scales: Scales, names) -> Float64[Array, "n"]:
    if not 0 <= lam < np.inf:
        raise ValueError(f"lam must be a number of at least 0, not {lam}")
    total = _divide_by_scale(name, first, scales, names)
    if lpips is not None:
        return total + lam * _divide_by_scale("lpips", lpips, scales, names)
    if lam > 0:
        _log.warning(
            "the scores lack LPIPS, its term is left out: the uncertainty is %s alone; "
            "set the config's `lpips` to `installed` or to a path (docs/reference/config.md)",
            name,
        )
    return total


def _divide_by_scale(name: str, values: Float[Array, "n"], scales: Scales, names) -> Float64[Array, "n"]:
    if name not in scales.by_term:
        raise ValueError(f"{name} has no frozen scale")
    require_finite(values, name, names)
    scale = scales.by_term[name]
    return values.astype(np.float64) / scale if scale > 0 else np.zeros(len(values))


def normalise(
    u: Float[Array, "..."], quantiles: Quantiles, names: Sequence[str] | None = None
) -> Float32[Array, "..."]:
    """Map u linearly to [0, 1], 0 at the low quantile and below, 1 at the high one and above.

    If both quantiles are equal, values above them become 1, the others 0.
    Raises: ValueError: a value that is not finite, naming the poses (the first axis).
    """
    finite = np.isfinite(u).reshape(u.shape[0] if u.ndim else 1, -1)
    reject_poses(~np.all(finite, axis=1), "not finite: the uncertainty", names)
    wide = u.astype(np.float64)
    span = quantiles.high - quantiles.low
    share = (wide - quantiles.low) / span if span > 0 else wide > quantiles.high
    return np.clip(share, 0, 1).astype(np.float32)


def gamma(u: Float[Array, "..."], slope: float = 2.0) -> Float[Array, "..."]:
    """Weight of colour against semantics in a seam: 1 - sigmoid(slope (u - 1/2)), which is expit(1 - 2 u) as printed.

    u: normalised to [0, 1]. 1/2 at u = 1/2 and gamma(u) + gamma(1 - u) = 1 for every slope; finite for every u.
    Raises: ValueError: u is NaN. Source: DAV-GSWT, Eq. (gamma), slope 2.
    """
    if np.isnan(u).any():
        raise ValueError("gamma of an uncertainty that is not a number")
    return expit(u.dtype.type(slope) * (u.dtype.type(0.5) - u))
