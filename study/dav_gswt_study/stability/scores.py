"""Checks of numbers that decide: scores of views, their choice, the loss of fits, weights of seams."""

from decimal import Context, Decimal, localcontext
from itertools import combinations, product

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.tiles import energy
from dav_gswt.views import uncertainty as un
from dav_gswt.views.coverage import compute_gain
from dav_gswt.views.uncertainty import Quantiles
from dav_gswt_study.stability.formula import FLOAT32, FLOAT32_EPS, Case, Check

SIZES = tuple(10.0**power for power in range(-12, 7, 2))
SHIFTS = (0.0, 1.0, 1e6)
DIFFERENCES = tuple(10.0**power for power in range(-7, 1))
SIDE = 8
ROWS, COLUMNS = np.mgrid[:SIDE, :SIDE]


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


def _w2_sq(means: Array, variances: Array) -> Array:
    """Squared W2 between diagonal Gaussians: the squared distances of means and of deviations, summed."""
    return un.w2_sq(means)[1] + un.w2_sq(np.sqrt(variances, dtype=np.float64))[1]


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


def _coverage_cases() -> list[Case]:
    rng, cases = np.random.default_rng(0), []
    for known in (0.0, 1.0, 1e3, 1e9):
        for size in (1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6):
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


def random_images(count: int, side: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(0, 1, (count, side, side, 3)).astype(np.float32)


def _similar_cases() -> list[Case]:
    a, b = random_images(2, 48)
    weight = np.random.default_rng(2).uniform(0, 1, (48, 48)).astype(np.float32)
    cases = [Case(f"a share {d:g} of another", (a, a + np.float32(d) * (b - a), weight)) for d in DIFFERENCES]
    single = np.zeros_like(weight)
    single[3, 4] = 1e-12
    return [
        *cases,
        Case("a single pixel that counts 1e-12", (a, b, single)),
        Case("black, white", (0 * a, 0 * a + 1, weight)),
    ]


def _loss(a: Array, b: Array, weight: Array) -> float:
    return raster.loss(a, b, weight)[0]


def _loss_reference(a: Array, b: Array, weight: Array) -> float:
    """0.8 L1 + 0.2 (1 - SSIM) in float64, windows by dense sums."""
    from scipy.ndimage import convolve

    taps = np.exp(-((np.arange(11) - 5.0) ** 2) / (2 * 1.5**2))
    window = np.outer(taps, taps)[..., None]
    x, y, w = a.astype(np.float64), b.astype(np.float64), weight.astype(np.float64)[..., None] * np.ones(3)
    n = convolve(w, window, mode="constant")

    def mean(values: Array) -> Array:
        return np.where(n > 0, convolve(w * values, window, mode="constant") / np.where(n > 0, n, 1), 0)

    ma, mb = mean(x), mean(y)
    vaa, vbb, vab = mean(x * x) - ma * ma, mean(y * y) - mb * mb, mean(x * y) - ma * mb
    ssim = (2 * ma * mb + 1e-4) * (2 * vab + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (vaa + vbb + 9e-4))
    return float((w * (0.8 * np.abs(x - y) + 0.2 * (1 - ssim))).mean())


def _patch_cases() -> list[Case]:
    """Two patches of one exemplar: colours, semantic features, gamma, and the offset of the second patch."""
    cases, rng = [], np.random.default_rng(0)
    for size in SIZES:
        colour, ground = (rng.uniform(0, 1, (2 * SIDE, SIDE, 3)).astype(np.float32) * np.float32(size) for _ in "cg")
        for share, shift in product((0.0, 0.5, 1.0), (0, SIDE)):
            of = "identical patches" if shift == 0 else "two patches"
            cases.append(Case(f"{of}, colours of {size:g}, gamma {share:g}", (colour, ground, share, shift)))
    return cases


def _cells(shift: int) -> tuple[Array, Array]:
    return ROWS + shift, COLUMNS


def _weights(colour: Array, ground: Array, share: float, shift: int) -> Array:
    layers = energy.make_colour_layer(colour), energy.make_colour_layer(ground)
    terms = [(weight, layer) for weight, layer in zip((share, 1 - share), layers, strict=True) if weight > 0]
    return _concatenate_edges(*energy.compute_edge_costs(terms, _cells(0), _cells(shift)))


def _concatenate_edges(right: Array, upper: Array) -> Array:
    return np.concatenate([np.ravel(right), np.ravel(upper)])


def _gradient_terms(colour: Array, ground: Array, share: float, shift: int, kind: type):
    """D and G of each layer over its scale, weighted and summed, by the definition; for right and upper neighbours."""
    d, g = np.zeros(2 * SIDE * (SIDE - 1), kind), np.zeros(2 * SIDE * (SIDE - 1), kind)
    for weight, layers in ((share, colour), (1 - share, ground)):
        values = layers.astype(kind)
        slope = [np.sqrt((np.gradient(values, axis=axis) ** 2).sum(-1)) for axis in (1, 0)]
        spread = np.sqrt(2 * values.reshape(-1, 3).astype(np.float64).var(0).sum())
        units = energy.safe_unit(2 * float(spread)), energy.safe_unit(4 * float(np.mean(slope, dtype=np.float64)))
        apart = np.sqrt(((values[_cells(0)] - values[_cells(shift)]) ** 2).sum(-1))
        sides = [s[_cells(0)] + s[_cells(shift)] for s in slope]
        d += kind(weight) * _concatenate_edges(apart[:, :-1] + apart[:, 1:], apart[:-1] + apart[1:]) / kind(units[0])
        g += (
            kind(weight)
            * _concatenate_edges(sides[0][:, :-1] + sides[0][:, 1:], sides[1][:-1] + sides[1][1:])
            / kind(units[1])
        )
    return d, g


def _weights_reference(colour: Array, ground: Array, share: float, shift: int) -> Array:
    d, g = _gradient_terms(colour, ground, share, shift, np.float64)
    return d / (g + energy.EPS)


def _weights_printed(colour: Array, ground: Array, share: float, shift: int) -> Array:
    """The appendix: G over D."""
    d, g = _gradient_terms(colour, ground, share, shift, np.float32)
    return g / d


CHECKS = [
    Check("squared W2, mean over pairs of samples", _latent_cases, _w2_sq, w2_sq_by_pairs, relative=FLOAT32),
    Check(
        "W2 of deviations a millionth apart",
        _close_deviation_cases,
        _w2_sq,
        w2_sq_by_pairs,
        relative=FLOAT32,
        printed=w2_sq_as_printed,
    ),
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
    Check(
        "what a photo adds to coverage", _coverage_cases, _gain, _gain_reference, relative=1e-12, printed=_gain_printed
    ),
    Check("L1 and structural similarity", _similar_cases, _loss, _loss_reference, relative=1e-4, absolute=1e-6),
    Check(
        "seam weight: D / (G + eps)",
        _patch_cases,
        _weights,
        _weights_reference,
        relative=FLOAT32,
        absolute=1e-9,
        printed=_weights_printed,
    ),
]
