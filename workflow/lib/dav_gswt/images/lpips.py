"""LPIPS v0.1 on AlexNet: features after each ReLU, unit length per pixel, weighted squared difference, spatial mean.

Pictures are channels-last float32 in [-1, 1], of at least 31 pixels a side: less leaves AlexNet's third layer empty.
"""

from collections.abc import Iterator

import numpy as np
import torch
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array
from torch import Tensor
from torch.nn import functional

from dav_gswt.images.lpips_weights import Weights

LEAST = 31  # pixels a side
CHUNK = 1 << 19  # pixels whose features are held at a time, of each of two pictures
SHIFT, SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)  # the mean and deviation of photos, for [-1, 1]
STEPS = (4, 2), (1, 2), (1, 1), (1, 1), (1, 1)  # stride and padding of each convolution
POOLED = 1, 2  # convolutions that a 3 x 3 maximum at every second pixel goes before


def distance(a: Float32[Array, "n h w 3"], b: Float32[Array, "n h w 3"], weights: Weights) -> Float64[Array, "n"]:
    """LPIPS of each pair of pictures. 0 for equal ones, the same either way round.

    Raises: ValueError: sides under 31 pixels, values outside [-1, 1] or not finite.
    """
    _require_pictures(a)
    _require_pictures(b)
    heads = _to_tensors(weights.heads)
    out = np.zeros(len(a))
    with torch.inference_mode():
        for rows in _split_batch(len(a), a.shape[1] * a.shape[2]):
            ones, others = (_normalize_features(_run_layers(pictures[rows], weights)) for pictures in (a, b))
            for one, other, head in zip(ones, others, heads, strict=True):
                apart = one - other
                squares = torch.einsum("bchw,bchw,c->b", apart, apart, head).double()
                out[rows] += squares.numpy() / apart[0, 0].numel()
    return out


def pairwise_mean(pictures: Float32[Array, "n m h w 3"], weights: Weights) -> Float64[Array, "n"]:
    """Mean LPIPS over all pairs of the m pictures of each of n sets; each picture's features are computed once.

    As LPIPS is a weighted squared distance of unit features, its mean over pairs is twice their unbiased variance:
    O(m), not O(m^2). Exactly 0 where all m are equal. Raises: as `distance`.
    """
    n, m, h, w, _ = pictures.shape
    _require_pictures(pictures.reshape(n * m, h, w, 3))
    heads = _to_tensors(weights.heads)
    out = np.zeros(n)
    with torch.inference_mode():
        for rows in _split_batch(n, m * h * w):
            features = _normalize_features(_run_layers(pictures[rows].reshape(-1, h, w, 3), weights))
            for feature, head in zip(features, heads, strict=True):
                sets = feature.unflatten(0, (-1, m))
                variance = (sets - sets[:, :1]).var(1)  # of differences, so that equal ones give exactly 0
                out[rows] += 2 * torch.einsum("bchw,c->b", variance, head).double().numpy() / variance[0, 0].numel()
    return out


def layers(pictures: Float32[Array, "n h w 3"], weights: Weights) -> list[Float32[Array, "n _ _ _"]]:
    """AlexNet's features after each of its five ReLUs, finest first, channels first, not normalised.

    Their strides are 4, 8, 16, 16 and 16 pixels. Raises: as `distance`.
    """
    _require_pictures(pictures)
    parts = []
    with torch.inference_mode():
        for rows in _split_batch(len(pictures), pictures.shape[1] * pictures.shape[2]) or [slice(0, 0)]:
            parts.append([f.numpy() for f in _run_layers(pictures[rows], weights)])
    return [np.concatenate(layer) for layer in zip(*parts, strict=True)]


def resize_pictures(pictures: Float32[Array, "n h w 3"], side: int) -> Float32[Array, "n _ _ 3"]:
    """The pictures at side x side pixels, bilinear: 512 is the paper's, at which enlarged pictures look more alike."""
    small = functional.interpolate(
        torch.from_numpy(np.ascontiguousarray(pictures)).movedim(-1, 1), (side, side), mode="bilinear", antialias=True
    )
    return np.ascontiguousarray(small.movedim(1, -1).numpy().clip(-1, 1))


def _run_layers(pictures: Float32[Array, "b h w 3"], weights: Weights) -> Iterator[Float[Tensor, "b _ _ _"]]:
    x = torch.from_numpy(np.ascontiguousarray(pictures)).movedim(-1, 1)
    x = (x - torch.tensor(SHIFT)[:, None, None]) / torch.tensor(SCALE)[:, None, None]
    convolutions = zip(_to_tensors(weights.kernels), _to_tensors(weights.biases), STEPS, strict=True)
    for i, (kernel, bias, (stride, padding)) in enumerate(convolutions):
        if i in POOLED:
            x = functional.max_pool2d(x, 3, 2)
        x = functional.relu(functional.conv2d(x, kernel, bias, stride, padding))
        yield x


def _normalize_features(features: Iterator[Tensor]) -> Iterator[Tensor]:
    """Each pixel's features over their length; 0 where all are 0."""
    for x in features:
        yield x / (torch.linalg.vector_norm(x, dim=1, keepdim=True) + 1e-10)


def _to_tensors(arrays: tuple[Array, ...]) -> list[Tensor]:
    return [torch.from_numpy(a) for a in arrays]


def _split_batch(n: int, pixels: int) -> list[slice]:
    step = max(1, CHUNK // pixels)
    return [slice(start, start + step) for start in range(0, n, step)]


def _require_pictures(pictures: Float32[Array, "n h w 3"]) -> None:
    _, h, w, _ = pictures.shape
    if min(h, w) < LEAST:
        raise ValueError(f"LPIPS needs pictures of at least {LEAST} pixels a side, not {w} x {h}")
    if not np.abs(pictures).max(initial=0) <= 1:  # NaN is not
        raise ValueError("a picture has values outside [-1, 1], or some that are not finite")
