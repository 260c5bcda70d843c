"""Formulas of the uncertainty of a view: disagreement, texture, likeness, and how they are put together."""

import numpy as np
from numpy import ndarray as Array

from dav_gswt.bundle.orders import Rings
from dav_gswt.study.stability.formula import LAW, SINGLE, Formula, Point, Tolerance
from dav_gswt.views import uncertainty as un
from dav_gswt.views.uncertainty.weighting import Quantiles, Scales

SIZES = tuple(10.0**power for power in range(-12, 7, 2))
SHIFTS = (0.0, 1.0, 1e6)
EXACT = Tolerance(0.0, 0.0, "exact")


def drawn(*shape: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).standard_normal(shape, dtype=np.float32)


def _latents() -> list[Point]:
    found = []
    for size in SIZES:
        for shift in SHIFTS:
            means, wide = (drawn(2, 5, 4, 6, 6, seed=s) * np.float32(size) + np.float32(shift) for s in (0, 1))
            found.append(Point(f"latents of {size:g} about {shift:g}", (means, wide * wide)))
    return found


def _near_deviations() -> list[Point]:
    found = []
    for size in SIZES:
        means, variances = np.zeros((1, 2, 1, 1, 1), np.float32), np.zeros((1, 2, 1, 1, 1), np.float32)
        variances[0, :, 0, 0, 0] = np.array([size, size * (1 + 1e-6)]) ** 2
        found.append(Point(f"deviations {size:g} and {size:g} (1 + 1e-6)", (means, variances)))
    return found


def _deviations_of_numerics() -> list[Point]:
    variances = np.zeros((1, 2, 1, 1, 1), np.float32)
    variances[0, :, 0, 0, 0] = np.array([1e6, 1e6 + 1]) ** 2
    return [Point("deviations 1e6 and 1e6 + 1", (np.zeros_like(variances), variances))]


def _ours_w2(means: Array, variances: Array) -> Array:
    return un.w2_sq(means, variances)[1]


def _equal_samples() -> list[Point]:
    found = []
    for size in SIZES:
        one = np.repeat(drawn(1, 1, 4, 6, 6) * np.float32(size), 5, 1)
        found.append(Point(f"five equal latents of {size:g}", (one, one * one)))
    return found


def _dropped(p: float) -> float:
    """What is left of ones after a held mask: that is not 0."""
    import torch

    from dav_gswt.prior.dropout import HeldDropout

    layer = HeldDropout(0)
    layer.begin(4, p, 0)
    kept = layer(torch.ones(4, 256, 256)).numpy()
    return float(kept.max())


def _points_pictures() -> list[Point]:
    ramp = np.tile(np.arange(24, dtype=np.float32), (24, 1))[None, None, :, :, None].repeat(3, -1)
    found = [Point(f"noise of {size:g}", (drawn(2, 3, 24, 24, 3) * np.float32(size),)) for size in SIZES]
    found += [Point(f"noise of {size:g} about 1", (1 + drawn(2, 3, 24, 24, 3) * np.float32(size),)) for size in SIZES]
    found += [Point(f"a ramp of {size:g} a pixel", (ramp * np.float32(size),)) for size in SIZES]
    return [*found, Point("a constant picture", (np.full((1, 2, 24, 24, 3), 0.3, np.float32),))]


def _slope(pictures: Array) -> Array:
    from scipy.ndimage import sobel

    grey = pictures.astype(np.float64).mean(1) @ np.array([0.2126, 0.7152, 0.0722])
    return np.array([np.hypot(sobel(g, 0, mode="mirror"), sobel(g, 1, mode="mirror")).mean() / 8 for g in grey])


def _sums() -> list[Point]:
    found = []
    for size in SIZES:
        w2, lpips = (np.abs(drawn(50, seed=s)) * np.float32(size) for s in (0, 1))
        for lam in (0.0, 0.1, 1.0, 1e6):
            found.append(Point(f"terms of {size:g}, lambda {lam:g}", (w2, lpips / np.float32(size), lam)))
    return found


def _combined(w2: Array, lpips: Array, lam: float) -> Array:
    return un.combine_terms(w2, lpips, lam, Scales.frozen({"w2_sq": w2, "lpips": lpips}))


def _combined_slowly(w2: Array, lpips: Array, lam: float) -> Array:
    a, b = ([float(v) for v in values] for values in (w2, lpips))
    middle = [float(np.median([v for v in values if v != 0])) for values in (a, b)]
    return np.array([x / middle[0] + lam * y / middle[1] for x, y in zip(a, b, strict=True)])


def _doubts() -> list[Point]:
    far = np.concatenate([-(10.0 ** np.linspace(8, -12, 41)), [0.0, 0.5, 1.0], 10.0 ** np.linspace(-12, 8, 41)])
    return [Point(f"slope {slope:g}, u = ", (far.astype(np.float32), slope), far) for slope in (2.0, 0.1, 100.0)]


def _gamma_slowly(u: Array, slope: float) -> Array:
    x = slope * (u.astype(np.float64) - 0.5)
    return np.where(x > 0, np.exp(-np.abs(x)), 1.0) / (1 + np.exp(-np.abs(x)))


def _gamma_printed(u: Array, slope: float) -> Array:
    one = np.float32(1)
    return one - one / (one + np.exp(-np.float32(slope) * (u - np.float32(0.5))))


def _spans() -> list[Point]:
    found = []
    for span in (0.0, *SIZES):
        u = np.linspace(-1, 2, 61).astype(np.float32) * np.float32(span)
        found.append(Point(f"quantiles 0 and {span:g}, u = ", (u, 0.0, span), u))
    return found


def _normalised(u: Array, low: float, high: float) -> Array:
    return un.normalise(u, Quantiles(low, high))


def _normalised_slowly(u: Array, low: float, high: float) -> Array:
    return np.array([min(max((float(x) - low) / (high - low), 0), 1) if high > low else float(x > high) for x in u])


def _thresholds() -> list[Point]:
    near = np.float64([0, 1e-12, 0.3, 0.6 - 1e-12, 0.6, 0.6 + 1e-12, 1 - 1e-12, 1])
    return [Point(f"tau {tau:g}, u = ", (near, tau), near) for tau in (0.0, 1e-12, 0.6, 1 - 1e-12, 1.0)]


def _kept(u: Array, tau: float) -> Array:
    return np.array([len(Rings().kept(float(x), tau)) for x in u])


def _kept_slowly(u: Array, tau: float) -> Array:
    return np.array([17 if x >= tau and tau < 1 else 9 for x in u])


W2 = "W2 (Eq. w2_pixel)"
FORMULAS = [
    Formula(
        W2,
        "squared W2, mean over pairs of samples",
        "Eq. (w2_pixel)",
        "latents 1e-12 to 1e6 about 0, 1, 1e6",
        "float32",
        _latents,
        _ours_w2,
        un.w2_sq_by_pairs,
        Tolerance(1e-5, 0.0, "docs/research/numerics.md"),
    ),
    Formula(
        W2,
        "W2 of two deviations",
        "Eq. (w2_pixel)",
        "1e6 and 1e6 + 1",
        "float32",
        _deviations_of_numerics,
        _ours_w2,
        un.w2_sq_by_pairs,
        Tolerance(1e-5, 0.0, "docs/research/numerics.md"),
        un.w2_sq_as_printed,
    ),
    Formula(
        W2,
        "W2 of deviations a millionth apart",
        "Eq. (w2_pixel)",
        "1e-12 to 1e6",
        "float32",
        _near_deviations,
        _ours_w2,
        un.w2_sq_by_pairs,
        Tolerance(1e-5, 0.0, "docs/research/numerics.md"),
        un.w2_sq_as_printed,
    ),
    Formula(
        "variance of one latent",
        "W2 of equal samples is 0",
        "Eq. (w2_pixel)",
        "latents 1e-12 to 1e6",
        "float32",
        _equal_samples,
        _ours_w2,
        un.w2_sq_by_pairs,
        EXACT,
    ),
    Formula(
        "the M samples",
        "dropout multiplies by 1 / (1 - p)",
        "appendix, attention dropout",
        "p from 0 to 0.999",
        "float32",
        lambda: [Point(f"p = {p:g}", (p,)) for p in (0.0, 0.05, 0.15, 0.95, 0.999)],
        _dropped,
        lambda p: 1 / (1 - p),
        Tolerance(SINGLE, 0.0, "a rounding of float32"),
    ),
    Formula(
        "u_img",
        "u_img: mean slope of a picture",
        "Eq. (uncert_img)",
        "pictures of 1e-12 to 1e6",
        "float32",
        _points_pictures,
        un.image_gradient,
        _slope,
        Tolerance(LAW[0], 1e-15, LAW[1]),
    ),
    Formula(
        "u = W2 + lambda LPIPS",
        "u: both terms over their scales",
        "Eq. (uncert_latent)",
        "terms 1e-12 to 1e6, lambda 0 to 1e6",
        "float32",
        _sums,
        _combined,
        _combined_slowly,
        Tolerance(LAW[0], 0.0, LAW[1]),
    ),
    Formula(
        "gamma",
        "gamma: expit(slope (1/2 - u))",
        "Eq. (gamma)",
        "u from -1e8 to 1e8, slopes 0.1 to 100",
        "float32",
        _doubts,
        un.gamma,
        _gamma_slowly,
        Tolerance(LAW[0], 1e-30, LAW[1] + "; below 1e-30 it is as good as 0"),
        _gamma_printed,
    ),
    Formula(
        "tau",
        "u brought to [0, 1] by quantiles",
        "Real-time rendering",
        "spans 0 and 1e-12 to 1e6",
        "float32",
        _spans,
        _normalised,
        _normalised_slowly,
        Tolerance(SINGLE, 1e-30, "a rounding of float32"),
    ),
    Formula(
        "tau",
        "orders that a tile keeps",
        "Real-time rendering",
        "u and tau from 0 to 1, a 1e-12 beside",
        "integer",
        _thresholds,
        _kept,
        _kept_slowly,
        EXACT,
    ),
]
