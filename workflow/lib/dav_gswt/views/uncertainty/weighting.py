"""Terms of other units put together: each over a scale frozen at the first round, then brought to [0, 1].

Raw terms are what is stored; lam enters when views are chosen, so its sweep shares the scoring.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.views.uncertainty.finite import reject_poses, require_finite

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Scales:
    """What each term is divided by: a scene's, frozen at t = 1. 0: the term was 0 everywhere, and weighs nothing."""

    of: dict[str, float]

    def __post_init__(self):
        if bad := [name for name, scale in self.of.items() if not 0 <= scale < np.inf]:
            raise ValueError(f"the scale of {', '.join(bad)} is not a number of at least 0")

    @staticmethod
    def frozen(terms: Mapping[str, Float[Array, "n"]], names: Sequence[str] | None = None) -> "Scales":
        """The robust scales of the terms of all candidates. A term that is 0 everywhere is said.

        Raises: ValueError: a value that is not finite, naming the poses.
        """
        for name, values in terms.items():
            require_finite(values, name, names)
        scales = Scales({name: robust_scale(values) for name, values in terms.items()})
        for name in (n for n, scale in scales.of.items() if scale == 0):
            _log.warning("%s is 0 at every candidate: the term weighs nothing", name)
        return scales

    def write(self, path: Path | str) -> None:
        """As JSON, to the same bits."""
        write_json(path, self.of)

    @staticmethod
    def read(path: Path | str) -> "Scales":
        """Raises: InputError: not what `write` wrote."""
        return Scales(_read_numbers(path, lambda scale: scale >= 0))


@dataclass(frozen=True)
class Quantiles:
    """The uncertainties that become 0 and 1: a scene's, frozen at t = 1."""

    low: float
    high: float

    @staticmethod
    def frozen(u: Float[Array, "n"], low: float = 0.05, high: float = 0.95) -> "Quantiles":
        """Quantiles of all candidates' uncertainties. Raises: ValueError: none is there, or one is not finite."""
        if not len(u):
            raise ValueError("no candidate pose is there to take quantiles of")
        require_finite(u, "the uncertainty")
        return Quantiles(*(float(q) for q in np.quantile(u.astype(np.float64), [low, high])))

    def write(self, path: Path | str) -> None:
        """As JSON, to the same bits."""
        write_json(path, asdict(self))

    @staticmethod
    def read(path: Path | str) -> "Quantiles":
        """Raises: InputError: not what `write` wrote."""
        found = _read_numbers(path)
        if set(found) != {"low", "high"} or found["low"] > found["high"]:
            raise InputError(f"{path}: needs the numbers low <= high, and nothing else")
        return Quantiles(**found)


def _read_numbers(path: Path | str, good=lambda number: True) -> dict[str, float]:
    """JSON of finite numbers by name. Raises: InputError: anything else."""
    found = read_json(path)
    if not isinstance(found, dict):
        raise InputError(f"{path}: is not a table of numbers")
    for name, number in found.items():
        usable = isinstance(number, int | float) and not isinstance(number, bool) and np.isfinite(number)
        if not usable or not good(number):
            raise InputError(f"{path}: {name} is not a number that can be used ({number})")
    return {name: float(number) for name, number in found.items()}


def robust_scale(values: Float[Array, "n"]) -> float:
    """Median absolute value of those that are not 0, or 0 if all are: as large as a usual value, whatever outliers do.

    Zeros are left out since a term can be exactly 0 at most poses (all samples agree) and still tell the others apart.
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
    """u = W2 + lam LPIPS, each over its frozen scale (`w2_sq`, `lpips`). lpips: None where its weights are missing.

    lam = 0 ranks by W2, a large one by LPIPS; a latent space in other units ranks alike. Without LPIPS the term is
    left out, and said so if lam asks for it.
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
        _log.warning("LPIPS has no weights here: its term is left out, the uncertainty is %s alone", name)
    return total


def _divide_by_scale(name: str, values: Float[Array, "n"], scales: Scales, names) -> Float64[Array, "n"]:
    if name not in scales.of:
        raise ValueError(f"{name} has no frozen scale")
    require_finite(values, name, names)
    scale = scales.of[name]
    return values.astype(np.float64) / scale if scale > 0 else np.zeros(len(values))


def normalise(
    u: Float[Array, "..."], quantiles: Quantiles, names: Sequence[str] | None = None
) -> Float32[Array, "..."]:
    """u brought to [0, 1], 0 at the low quantile and below, 1 at the high one and above; of poses or of maps.

    Where both quantiles are equal (a scene that is doubted alike everywhere) what lies above them is 1, the rest 0.
    Raises: ValueError: a value that is not finite, naming the poses (the first axis).
    """
    reject_poses(~np.isfinite(u).reshape(u.shape[0] if u.ndim else 1, -1).all(1), "not finite: the uncertainty", names)
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
