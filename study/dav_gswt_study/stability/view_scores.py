"""Checks of the uncertainty scores of a view: W2, image gradient, LPIPS, their sum, gamma and tau."""

from itertools import combinations

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array

from dav_gswt.bundle.orders import DirectionRings
from dav_gswt.views import uncertainty as un
from dav_gswt.views.uncertainty import Quantiles, Scales
from dav_gswt_study.stability.formula import FLOAT32, FLOAT32_EPS, Case, Check

SIZES = tuple(10.0**power for power in range(-12, 7, 2))
SHIFTS = (0.0, 1.0, 1e6)


def sample_normal(*shape: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).standard_normal(shape, dtype=np.float32)


def w2_sq_by_pairs(
    means: Float[Array, "n m c h w"], variances: Float[Array, "n m c h w"] | None = None
) -> Float64[Array, "n h w"]:
    """The map of `w2_sq`, pair by pair in float64: the definition, slow."""
    mu = means.astype(np.float64)
    s = np.zeros_like(mu) if variances is None else np.sqrt(variances, dtype=np.float64)
    pairs = list(combinations(range(mu.shape[1]), 2))
    total = np.zeros((len(mu), *mu.shape[3:]))
    for i, j in pairs:
        total += ((mu[:, i] - mu[:, j]) ** 2 + (s[:, i] - s[:, j]) ** 2).sum(1)
    return total / len(pairs)


def w2_sq_as_printed(
    means: Float32[Array, "n m c h w"], variances: Float32[Array, "n m c h w"]
) -> Float32[Array, "n h w"]:
    """Eq. (w2_pixel) as printed, s_i^2 + s_j^2 - 2 sqrt(s_i^2 s_j^2), in float32: unsafe, for ablations only.

    It cancels: deviations of 1e6 and 1e6 + 1, whose distance is 1, give -131072.
    """
    pairs = list(combinations(range(means.shape[1]), 2))
    total = np.zeros((len(means), *means.shape[3:]), np.float32)
    for i, j in pairs:
        a, b = variances[:, i], variances[:, j]
        total += ((means[:, i] - means[:, j]) ** 2 + (a + b - 2 * np.sqrt(a * b))).sum(1)
    return total / np.float32(len(pairs))


def _latent_cases() -> list[Case]:
    cases = []
    for size in SIZES:
        for shift in SHIFTS:
            means, wide = (sample_normal(2, 5, 4, 6, 6, seed=s) * np.float32(size) + np.float32(shift) for s in (0, 1))
            cases.append(Case(f"latents of {size:g} about {shift:g}", (means, wide * wide)))
    return cases


def _close_deviation_cases() -> list[Case]:
    cases = []
    for size in SIZES:
        means, variances = np.zeros((1, 2, 1, 1, 1), np.float32), np.zeros((1, 2, 1, 1, 1), np.float32)
        variances[0, :, 0, 0, 0] = np.array([size, size * (1 + 1e-6)]) ** 2
        cases.append(Case(f"deviations {size:g} and {size:g} (1 + 1e-6)", (means, variances)))
    return cases


def _large_deviation_cases() -> list[Case]:
    variances = np.zeros((1, 2, 1, 1, 1), np.float32)
    variances[0, :, 0, 0, 0] = np.array([1e6, 1e6 + 1]) ** 2
    return [Case("deviations 1e6 and 1e6 + 1", (np.zeros_like(variances), variances))]


def _w2_sq(means: Array, variances: Array) -> Array:
    return un.w2_sq(means, variances)[1]


def _equal_sample_cases() -> list[Case]:
    cases = []
    for size in SIZES:
        one = np.repeat(sample_normal(1, 1, 4, 6, 6) * np.float32(size), 5, 1)
        cases.append(Case(f"five equal latents of {size:g}", (one, one * one)))
    return cases


def _kept_by_dropout(p: float) -> float:
    """The factor by which dropout scales what it keeps."""
    import torch

    from dav_gswt.prior.dropout import HeldDropout

    layer = HeldDropout(0)
    layer.begin(4, p, 0)
    kept = layer(torch.ones(4, 256, 256)).numpy()
    return float(kept.max())


def _picture_cases() -> list[Case]:
    ramp = np.tile(np.arange(24, dtype=np.float32), (24, 1))[None, None, :, :, None].repeat(3, -1)
    cases = [Case(f"noise of {size:g}", (sample_normal(2, 3, 24, 24, 3) * np.float32(size),)) for size in SIZES]
    cases += [
        Case(f"noise of {size:g} about 1", (1 + sample_normal(2, 3, 24, 24, 3) * np.float32(size),)) for size in SIZES
    ]
    cases += [Case(f"a ramp of {size:g} a pixel", (ramp * np.float32(size),)) for size in SIZES]
    return [*cases, Case("a constant picture", (np.full((1, 2, 24, 24, 3), 0.3, np.float32),))]


def _image_gradient_reference(pictures: Array) -> Array:
    from scipy.ndimage import sobel

    grey = pictures.astype(np.float64).mean(1) @ np.array([0.2126, 0.7152, 0.0722])
    return np.array([np.hypot(sobel(g, 0, mode="mirror"), sobel(g, 1, mode="mirror")).mean() / 8 for g in grey])


def _term_cases() -> list[Case]:
    cases = []
    for size in SIZES:
        w2, lpips = (np.abs(sample_normal(50, seed=s)) * np.float32(size) for s in (0, 1))
        for lam in (0.0, 0.1, 1.0, 1e6):
            cases.append(Case(f"terms of {size:g}, lambda {lam:g}", (w2, lpips / np.float32(size), lam)))
    return cases


def _combine(w2: Array, lpips: Array, lam: float) -> Array:
    return un.combine_terms(w2, lpips, lam, Scales.from_terms({"w2_sq": w2, "lpips": lpips}))


def _combine_reference(w2: Array, lpips: Array, lam: float) -> Array:
    a, b = ([float(v) for v in values] for values in (w2, lpips))
    middle = [float(np.median([v for v in values if v != 0])) for values in (a, b)]
    return np.array([x / middle[0] + lam * y / middle[1] for x, y in zip(a, b, strict=True)])


def _uncertainty_cases() -> list[Case]:
    far = np.concatenate([-(10.0 ** np.linspace(8, -12, 41)), [0.0, 0.5, 1.0], 10.0 ** np.linspace(-12, 8, 41)])
    return [Case(f"slope {slope:g}, u = ", (far.astype(np.float32), slope), far) for slope in (2.0, 0.1, 100.0)]


def _gamma_reference(u: Array, slope: float) -> Array:
    x = slope * (u.astype(np.float64) - 0.5)
    return np.where(x > 0, np.exp(-np.abs(x)), 1.0) / (1 + np.exp(-np.abs(x)))


def _gamma_printed(u: Array, slope: float) -> Array:
    one = np.float32(1)
    return one - one / (one + np.exp(-np.float32(slope) * (u - np.float32(0.5))))


def _quantile_cases() -> list[Case]:
    cases = []
    for span in (0.0, *SIZES):
        u = np.linspace(-1, 2, 61).astype(np.float32) * np.float32(span)
        cases.append(Case(f"quantiles 0 and {span:g}, u = ", (u, 0.0, span), u))
    return cases


def _normalise(u: Array, low: float, high: float) -> Array:
    return un.normalise(u, Quantiles(low, high))


def _normalise_reference(u: Array, low: float, high: float) -> Array:
    return np.array([min(max((float(x) - low) / (high - low), 0), 1) if high > low else float(x > high) for x in u])


def _threshold_cases() -> list[Case]:
    near = np.array([0, 1e-12, 0.3, 0.6 - 1e-12, 0.6, 0.6 + 1e-12, 1 - 1e-12, 1], np.float64)
    return [Case(f"tau {tau:g}, u = ", (near, tau), near) for tau in (0.0, 1e-12, 0.6, 1 - 1e-12, 1.0)]


def _order_count(u: Array, tau: float) -> Array:
    return np.array([len(DirectionRings().select_directions(float(x), tau)) for x in u])


def _order_count_reference(u: Array, tau: float) -> Array:
    return np.array([17 if x >= tau and tau < 1 else 9 for x in u])


CHECKS = [
    Check("squared W2, mean over pairs of samples", _latent_cases, _w2_sq, w2_sq_by_pairs, relative=FLOAT32),
    Check(
        "W2 of two deviations",
        _large_deviation_cases,
        _w2_sq,
        w2_sq_by_pairs,
        relative=FLOAT32,
        printed=w2_sq_as_printed,
    ),
    Check(
        "W2 of deviations a millionth apart",
        _close_deviation_cases,
        _w2_sq,
        w2_sq_by_pairs,
        relative=FLOAT32,
        printed=w2_sq_as_printed,
    ),
    Check("W2 of equal samples is 0", _equal_sample_cases, _w2_sq, w2_sq_by_pairs),
    Check(
        "dropout multiplies by 1 / (1 - p)",
        lambda: [Case(f"p = {p:g}", (p,)) for p in (0.0, 0.05, 0.15, 0.95, 0.999)],
        _kept_by_dropout,
        lambda p: 1 / (1 - p),
        relative=FLOAT32_EPS,
    ),
    Check(
        "u_img: mean slope of a picture",
        _picture_cases,
        un.image_gradient,
        _image_gradient_reference,
        relative=FLOAT32,
        absolute=1e-15,
    ),
    Check("u: both terms over their scales", _term_cases, _combine, _combine_reference, relative=FLOAT32),
    Check(
        "gamma: expit(slope (1/2 - u))",
        _uncertainty_cases,
        un.gamma,
        _gamma_reference,
        relative=FLOAT32,
        absolute=1e-30,
        printed=_gamma_printed,
    ),
    Check(
        "u brought to [0, 1] by quantiles",
        _quantile_cases,
        _normalise,
        _normalise_reference,
        relative=FLOAT32_EPS,
        absolute=1e-30,
    ),
    Check("orders that a tile keeps", _threshold_cases, _order_count, _order_count_reference),
]
