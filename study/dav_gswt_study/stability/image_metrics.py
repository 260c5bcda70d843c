"""Checks of image metrics: LPIPS, PSNR, colour correction, the loss of the fit; and of Adam."""

import numpy as np
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.images import lpips_weights, metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt_study.stability.formula import FLOAT32, Case, Check

DIFFERENCES = tuple(10.0**power for power in range(-7, 1))


def random_images(count: int, side: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(0, 1, (count, side, side, 3)).astype(np.float32)


def random_network() -> Weights:
    """Random weights with the shapes and magnitudes of LPIPS's AlexNet: rounding does not depend on their values."""
    rng = np.random.default_rng(0)
    kernels = tuple(
        (rng.standard_normal(s) * (2 / np.prod(s[1:])) ** 0.5).astype(np.float32) for s in lpips_weights.KERNELS
    )
    biases = tuple((0.1 * rng.standard_normal(s[0])).astype(np.float32) for s in lpips_weights.KERNELS)
    heads = tuple(np.abs(0.3 * rng.standard_normal(s[0])).astype(np.float32) for s in lpips_weights.KERNELS)
    return Weights(kernels, biases, heads)


def _pair_cases() -> list[Case]:
    a = 2 * random_images(1, 48) - 1
    b = 2 * random_images(1, 48, seed=1) - 1
    cases = [Case(f"noise mixed with {d:g} of another", (a, a + np.float32(d) * (b - a))) for d in DIFFERENCES]
    flat = [np.full_like(a, v) for v in (-1, 1)]
    least = 2 * random_images(2, 31) - 1
    cases += [
        Case("black and white", tuple(flat)),
        Case("equal pictures", (a, a)),
        Case("two greys", (0 * a, 0 * a)),
    ]
    return [*cases, Case("31 pixels a side", (least[:1], least[1:]))]


def _lpips(a: Array, b: Array) -> Array:
    from dav_gswt.images import lpips

    return lpips.distance(a, b, random_network())


def _lpips_pairwise(a: Array, b: Array) -> Array:
    from dav_gswt.images import lpips

    return lpips.pairwise_mean(np.stack([a, b], 1), random_network())


def _lpips_reference(a: Array, b: Array) -> Array:
    """LPIPS in float64 by its definition."""
    import torch
    from torch.nn import functional

    made, total = random_network(), 0.0
    shift, scale = (torch.tensor(v, dtype=torch.float64)[:, None, None] for v in (_SHIFT, _SCALE))
    x = torch.from_numpy(np.concatenate([a, b]).astype(np.float64)).movedim(-1, 1)
    x = (x - shift) / scale
    for i, (stride, padding) in enumerate(((4, 2), (1, 2), (1, 1), (1, 1), (1, 1))):
        kernel, bias, head = (
            torch.from_numpy(v[i].astype(np.float64)) for v in (made.kernels, made.biases, made.heads)
        )
        x = functional.max_pool2d(x, 3, 2) if i in (1, 2) else x
        x = functional.relu(functional.conv2d(x, kernel, bias, stride, padding))
        unit = x / (x.norm(dim=1, keepdim=True) + 1e-10)
        total += float((((unit[0] - unit[1]) ** 2) * head[:, None, None]).sum(0).mean())
    return np.array([total])


_SHIFT, _SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)


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


def _psnr(a: Array, b: Array, weight: Array) -> float | None:
    return metrics.psnr(a, b, weight)


def _psnr_reference(a: Array, b: Array, weight: Array) -> float:
    a, b, weight = (v.astype(np.float64) for v in (a, b, weight))
    return -10 * np.log10((((a - b) ** 2).mean(-1) * weight).sum() / weight.sum())


def _equal_cases() -> list[Case]:
    one = np.ones((48, 48), np.float32)
    return [
        Case(f"equal pictures of {size:g}", (random_images(1, 48)[0] * np.float32(size), one)) for size in (0, 1e-6, 1)
    ]


def _colour_correct(a: Array, b: Array, weight: Array) -> Array:
    return metrics.correct_colours(a, b, weight)


def _colour_correct_reference(a: Array, b: Array, weight: Array) -> Array:
    keep, out = weight > 0, np.empty(a.shape)
    for c in range(3):
        x, y = a[keep, c].astype(np.float64), b[keep, c].astype(np.float64)
        gain = ((x - x.mean()) * (y - y.mean())).mean() / max(((x - x.mean()) ** 2).mean(), 1e-9)
        out[..., c] = y.mean() + gain * (a[..., c].astype(np.float64) - x.mean())
    return out


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


def _gradient_cases() -> list[Case]:
    sizes = 10.0 ** np.linspace(-30, 18, 97)
    return [Case("gradient ", (sizes.astype(np.float32),), sizes)]


def _adam(gradient: Array) -> Array:
    value, first, second = (np.zeros_like(gradient) for _ in range(3))
    for step in (1, 2, 3):
        raster.adam(value, gradient, first, second, 1.0, step)
    return value


def _adam_reference(gradient: Array) -> Array:
    g, value, m, v = gradient.astype(np.float64), 0.0, 0.0, 0.0
    for step in (1, 2, 3):
        m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g
        value -= m / (1 - 0.9**step) / (np.sqrt(v / (1 - 0.999**step)) + 1e-15)
    return value


CHECKS = [
    Check("LPIPS of two pictures", _pair_cases, _lpips, _lpips_reference, relative=FLOAT32, absolute=1e-6),
    Check(
        "LPIPS, mean over pairs as a variance",
        _pair_cases,
        _lpips_pairwise,
        _lpips_reference,
        relative=FLOAT32,
        absolute=1e-6,
    ),
    Check("PSNR over the pixels that count", _similar_cases, _psnr, _psnr_reference, relative=FLOAT32, absolute=1e-4),
    Check(
        "PSNR of equal pictures is null",
        _equal_cases,
        lambda a, weight: float(metrics.psnr(a, a, weight) is None),
        lambda a, weight: 1.0,
    ),
    Check(
        "a picture fitted to a photo by gain and offset",
        _similar_cases,
        _colour_correct,
        _colour_correct_reference,
        relative=FLOAT32,
        absolute=1e-6,
    ),
    Check("L1 and structural similarity", _similar_cases, _loss, _loss_reference, relative=1e-4, absolute=1e-6),
    Check("three steps of Adam", _gradient_cases, _adam, _adam_reference, relative=FLOAT32, absolute=1e-9),
]
