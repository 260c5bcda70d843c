"""Uncertainty of views from samples of a prior: the terms' formulas, how terms are combined, and gamma.

Each term is divided by a scale that the first round fixes. Only raw terms are stored; lam enters when poses are
selected, so that a sweep over lam shares the scoring.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array
from scipy.special import expit

_log = logging.getLogger(__name__)

NAMED = 5  # poses named in a message
LUMINANCE = 0.2126, 0.7152, 0.0722  # of Rec. 709's red, green and blue


def require_finite(values: Float[Array, "n"], what: str, names: Sequence[str] | None = None) -> None:
    """Raises: ValueError: a value that is NaN or infinite, naming the poses, or their indices without names."""
    bad = np.flatnonzero(~np.isfinite(values)).tolist()
    if bad:
        found = [names[i] if names is not None else str(i) for i in bad[:NAMED]]
        more = f" and {len(bad) - NAMED} more" if len(bad) > NAMED else ""
        raise ValueError(f"not finite: {what} of pose {', '.join(found)}{more}")


def w2_sq(
    means: Float[Array, "n m c h w"],
    names: Sequence[str] | None = None,
) -> tuple[Float64[Array, "n"], Float32[Array, "n h w"]]:
    """Mean squared 2-Wasserstein distance between the pairs of m latent samples: of each pose, and of each pixel.

    A latent is a diagonal Gaussian a pixel, so the distance of a pair is |mu_i - mu_j|^2 + |s_i - s_j|^2 with the
    standard deviations s, which are equal here: samples are points. Its mean over all pairs is 2 var(ddof=1) of mu,
    summed over channels: O(m), and no difference of large squares. Samples are taken relative to the first one, so a
    common shift costs no digits.

    Args:   names: of the poses, for errors.
    Returns: the mean over pixels, and the map, both in squared latent units; exactly 0 where all samples agree.
    Raises: ValueError: m < 2 (no pair), or a value that is not finite or whose square is not, naming the poses.
    Source: DAV-GSWT, Eq. (w2_pixel), in a form that float32 holds.
    """
    if (m := means.shape[1]) < 2:
        raise ValueError(f"disagreement needs at least 2 samples of a pose, not {m}: one has no pair")
    with np.errstate(over="ignore", invalid="ignore"):  # rejected below
        apart = means - means[:, :1]  # exact for near values, and exactly 0 for equal ones
        apart -= apart.mean(1, keepdims=True)
        maps = np.einsum("bmchw,bmchw->bhw", apart, apart) * means.dtype.type(2 / (m - 1))
        scores = maps.mean((1, 2), dtype=np.float64)
    require_finite(scores, "the latents, or their squared distance,", names)
    return scores, maps.astype(np.float32)


def image_gradient(pictures: Float32[Array, "n m h w 3"]) -> Float64[Array, "n"]:
    """Mean over pixels of the gradient's 2-norm, of the mean of the m pictures decoded at each pose; per pixel step.

    Returns: 0 for a constant picture; a times as much for pictures times a.
    Source: DAV-GSWT, Eq. (uncert_img), its first term.
    """
    return gradient_map(pictures.mean(1, dtype=np.float64) @ np.array(LUMINANCE)).mean((1, 2))


def gradient_map(values: Float64[Array, "n h w"]) -> Float64[Array, "n h w"]:
    """Norm of the gradient by the Sobel operator over 8, with reflection at the border."""
    from scipy.ndimage import correlate1d  # deferred: the workflow reads this module before any job

    slopes = []
    for along, across in ((2, 1), (1, 2)):
        difference = correlate1d(values, [-1, 0, 1], along, mode="mirror")
        slopes.append(correlate1d(difference, [1 / 8, 2 / 8, 1 / 8], across, mode="mirror"))
    return np.hypot(*slopes)


@dataclass(frozen=True)
class Scales:
    """Divisor of each term of a scene, fixed in the first round. 0: the term was 0 everywhere, and has no weight."""

    by_term: dict[str, float]

    def __post_init__(self):
        if bad := [name for name, scale in self.by_term.items() if not 0 <= scale < np.inf]:
            raise ValueError(f"the scale of {', '.join(bad)} is not a number of at least 0")

    @staticmethod
    def from_terms(terms: Mapping[str, Float[Array, "n"]]) -> "Scales":
        """Compute robust scales of the terms of all candidates. A term that is 0 everywhere is logged."""
        scales = Scales({name: robust_scale(values) for name, values in terms.items()})
        for name in (n for n, scale in scales.by_term.items() if scale == 0 and len(terms[n])):
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
        """Quantiles of all candidates' uncertainties."""
        return Quantiles(*(float(q) for q in np.quantile(u.astype(np.float64), [low, high])))


def robust_scale(values: Float[Array, "n"]) -> float:
    """Median absolute value of the values that are not 0; 0 if all are.

    Zeros are excluded since a term can be exactly 0 at most poses, where all samples agree.
    """
    size = np.abs(values.astype(np.float64))
    return float(np.median(size[size > 0])) if (size > 0).any() else 0.0


def combine_terms(
    first: Float[Array, "n"],
    lpips: Float[Array, "n"] | None,
    lam: float,
    scales: Scales,
    name: str = "w2_sq",
) -> Float64[Array, "n"]:
    """u = W2² + lam LPIPS, each over its frozen scale (`w2_sq`, `lpips`). lpips: None where its weights are missing.

    lam = 0 ranks by W2, a large lam by LPIPS; the units of the latent space do not matter. Without LPIPS its term is
    left out, with a warning if lam > 0. name: `gradient` for u_img, an ablation, with the picture's gradient in place
    of W2; the appendix's aggregate of both is their sum.
    Source: DAV-GSWT, Eq. (uncert_latent), Eq. (uncert_img).
    """
    total = divide_by_scale(name, first, scales)
    if lpips is not None:
        return total + lam * divide_by_scale("lpips", lpips, scales)
    if lam > 0:
        _log.warning(
            "the scores lack LPIPS, its term is left out: the uncertainty is %s alone; "
            "set the config's `lpips` to `installed` or to a path (workflow/schemas/config.schema.json)",
            name,
        )
    return total


def divide_by_scale(name: str, values: Float[Array, "n"], scales: Scales) -> Float64[Array, "n"]:
    """Values of a term over its scale; 0 where that is 0."""
    scale = scales.by_term[name]
    return values.astype(np.float64) / scale if scale > 0 else np.zeros(len(values))


def normalise(u: Float[Array, "..."], quantiles: Quantiles) -> Float32[Array, "..."]:
    """Map u linearly to [0, 1], 0 at the low quantile and below, 1 at the high one and above.

    If both quantiles are equal, values above them become 1, the others 0.
    """
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
