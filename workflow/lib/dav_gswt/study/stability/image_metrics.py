"""Formulas that say how alike pictures are: LPIPS, PSNR, structural similarity, and exposure between them."""

import numpy as np
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.images import lpips_weights, metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.study.stability.formula import LAW, Formula, Point, Tolerance
from dav_gswt.study.stability.scoring import EXACT

DIFFERENCES = tuple(10.0**power for power in range(-7, 1))


def pictures(count: int, side: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(0, 1, (count, side, side, 3)).astype(np.float32)


def network() -> Weights:
    """A network of LPIPS's shapes, its numbers as large as the published ones: what rounds does not depend on them."""
    rng = np.random.default_rng(0)
    kernels = tuple(
        (rng.standard_normal(s) * (2 / np.prod(s[1:])) ** 0.5).astype(np.float32) for s in lpips_weights.KERNELS
    )
    biases = tuple((0.1 * rng.standard_normal(s[0])).astype(np.float32) for s in lpips_weights.KERNELS)
    heads = tuple(np.abs(0.3 * rng.standard_normal(s[0])).astype(np.float32) for s in lpips_weights.KERNELS)
    return Weights(kernels, biases, heads)


def _pairs() -> list[Point]:
    a = 2 * pictures(1, 48) - 1
    b = 2 * pictures(1, 48, seed=1) - 1
    found = [Point(f"noise mixed with {d:g} of another", (a, a + np.float32(d) * (b - a))) for d in DIFFERENCES]
    flat = [np.full_like(a, v) for v in (-1, 1)]
    least = 2 * pictures(2, 31) - 1
    found += [
        Point("black and white", tuple(flat)),
        Point("equal pictures", (a, a)),
        Point("two greys", (0 * a, 0 * a)),
    ]
    return [*found, Point("31 pixels a side", (least[:1], least[1:]))]


def _lpips(a: Array, b: Array) -> Array:
    from dav_gswt.images import lpips

    return lpips.distance(a, b, network())


def _lpips_pairwise(a: Array, b: Array) -> Array:
    from dav_gswt.images import lpips

    return lpips.pairwise_mean(np.stack([a, b], 1), network())


def _lpips_slowly(a: Array, b: Array) -> Array:
    """LPIPS in float64 by its definition."""
    import torch
    from torch.nn import functional

    made, total = network(), 0.0
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


def _near() -> list[Point]:
    a, b = pictures(2, 48)
    weight = np.random.default_rng(2).uniform(0, 1, (48, 48)).astype(np.float32)
    found = [Point(f"a share {d:g} of another", (a, a + np.float32(d) * (b - a), weight)) for d in DIFFERENCES]
    single = np.zeros_like(weight)
    single[3, 4] = 1e-12
    return [
        *found,
        Point("a single pixel that counts 1e-12", (a, b, single)),
        Point("black, white", (0 * a, 0 * a + 1, weight)),
    ]


def _psnr(a: Array, b: Array, weight: Array) -> float:
    return metrics.psnr(a, b, weight)


def _psnr_slowly(a: Array, b: Array, weight: Array) -> float:
    a, b, weight = (v.astype(np.float64) for v in (a, b, weight))
    return -10 * np.log10((((a - b) ** 2).mean(-1) * weight).sum() / weight.sum())


def _equal() -> list[Point]:
    one = np.ones((48, 48), np.float32)
    return [Point(f"equal pictures of {size:g}", (pictures(1, 48)[0] * np.float32(size), one)) for size in (0, 1e-6, 1)]


def _corrected(a: Array, b: Array, weight: Array) -> Array:
    return metrics.correct_colours(a, b, weight)


def _corrected_slowly(a: Array, b: Array, weight: Array) -> Array:
    keep, out = weight > 0, np.empty(a.shape)
    for c in range(3):
        x, y = a[keep, c].astype(np.float64), b[keep, c].astype(np.float64)
        gain = ((x - x.mean()) * (y - y.mean())).mean() / max(((x - x.mean()) ** 2).mean(), 1e-9)
        out[..., c] = y.mean() + gain * (a[..., c].astype(np.float64) - x.mean())
    return out


def _loss(a: Array, b: Array, weight: Array) -> float:
    return raster.loss(a, b, weight)[0]


def _loss_slowly(a: Array, b: Array, weight: Array) -> float:
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


def _steps() -> list[Point]:
    sizes = 10.0 ** np.linspace(-30, 18, 97)
    return [Point("gradient ", (sizes.astype(np.float32),), sizes)]


def _adam(gradient: Array) -> Array:
    value, first, second = (np.zeros_like(gradient) for _ in range(3))
    for step in (1, 2, 3):
        raster.adam(value, gradient, first, second, 1.0, step)
    return value


def _adam_slowly(gradient: Array) -> Array:
    g, value, m, v = gradient.astype(np.float64), 0.0, 0.0, 0.0
    for step in (1, 2, 3):
        m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g
        value -= m / (1 - 0.9**step) / (np.sqrt(v / (1 - 0.999**step)) + 1e-15)
    return value


FORMULAS = [
    Formula(
        "LPIPS",
        "LPIPS of two pictures",
        "Zhang et al. 2018",
        "differences 1e-7 to 1, black and white, 31 pixels",
        "float32",
        _pairs,
        _lpips,
        _lpips_slowly,
        Tolerance(LAW[0], 1e-6, LAW[1] + "; 1e-6 is far below what is told apart"),
    ),
    Formula(
        "LPIPS",
        "LPIPS, mean over pairs as a variance",
        "Zhang et al. 2018",
        "the same",
        "float32",
        _pairs,
        _lpips_pairwise,
        _lpips_slowly,
        Tolerance(LAW[0], 1e-6, LAW[1] + "; 1e-6 is far below what is told apart"),
    ),
    Formula(
        "PSNR",
        "PSNR over the pixels that count",
        "docs/research/evaluation.md",
        "differences 1e-7 to 1",
        "float32",
        _near,
        _psnr,
        _psnr_slowly,
        Tolerance(LAW[0], 1e-4, LAW[1] + "; tables show 0.01 dB"),
    ),
    Formula(
        "PSNR",
        "PSNR of equal pictures is null",
        "docs/research/evaluation.md",
        "pictures of 0, 1e-6, 1",
        "float32",
        _equal,
        lambda a, weight: float(metrics.psnr(a, a, weight) is None),
        lambda a, weight: 1.0,
        EXACT,
    ),
    Formula(
        "PSNR",
        "a picture fitted to a photo by gain and offset",
        "docs/research/evaluation.md",
        "differences 1e-7 to 1",
        "float32",
        _near,
        _corrected,
        _corrected_slowly,
        Tolerance(LAW[0], 1e-6, LAW[1]),
    ),
    Formula(
        "fit",
        "L1 and structural similarity",
        "3DGS",
        "differences 1e-7 to 1",
        "float32",
        _near,
        _loss,
        _loss_slowly,
        Tolerance(1e-4, 1e-6, "variances are differences of squares: 6e-8 of 0.3 against 9e-4"),
    ),
    Formula(
        "fit",
        "three steps of Adam",
        "Kingma and Ba 2015",
        "gradients 1e-30 to 1e18",
        "float32",
        _steps,
        _adam,
        _adam_slowly,
        Tolerance(LAW[0], 1e-9, LAW[1]),
    ),
]
