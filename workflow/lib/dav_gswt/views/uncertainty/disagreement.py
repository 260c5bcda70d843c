"""Disagreement of a prior's samples at a pose: squared 2-Wasserstein distance of their latents."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array

from dav_gswt.views.uncertainty.finite import reject_poses, require_finite

CHUNK = 1 << 18  # values per chunk: fits a second-level cache


def w2_sq(
    means: Float32[Array, "n m c h w"],
    variances: Float32[Array, "n m c h w"] | None = None,
    names: Sequence[str] | None = None,
) -> tuple[Float64[Array, "n"], Float32[Array, "n h w"]]:
    """Mean squared 2-Wasserstein distance between the pairs of m latent samples: of each pose, and of each pixel.

    A latent is a diagonal Gaussian a pixel, so the distance of a pair is |mu_i - mu_j|^2 + |s_i - s_j|^2 with the
    standard deviations s. Its mean over all pairs is 2 var(ddof=1) of mu and of s, summed over channels: O(m), and no
    difference of large squares. Samples are taken relative to the first one, so a common shift costs no digits.

    Args:   variances: of each latent; None: each is a point (deviations 0). names: of the poses, for errors.
    Returns: the mean over pixels, and the map, both in squared latent units; exactly 0 where all samples agree.
    Raises: ValueError: m < 2 (no pair), a value that is not finite or whose square is not, a variance below 0, naming
            the poses.
    Source: DAV-GSWT, Eq. (w2_pixel), in the form that float32 holds; `w2_sq_as_printed` is the printed one.
    """
    n, m, c, h, w = means.shape
    _require_pairs(m)
    maps = np.empty((n, h, w), np.float32)
    scores = np.empty(n)
    step = max(1, CHUNK // max(1, m * c * h * w))
    for start in range(0, n, step):
        rows = slice(start, start + step)
        with np.errstate(over="ignore", invalid="ignore"):  # rejected below
            found = _twice_the_variance(means[rows])
            if variances is not None:
                reject_poses(np.any(variances[rows] < 0, axis=(1, 2, 3, 4)), "variance below 0", names and names[rows])
                found = found + _twice_the_variance(np.sqrt(variances[rows], dtype=np.float64))
            maps[rows] = found
            scores[rows] = found.mean((1, 2), dtype=np.float64)
    require_finite(scores, "the latents, or their squared distance,", names)
    return scores, maps


def _twice_the_variance(samples: Float[Array, "b m c h w"]) -> Float[Array, "b h w"]:
    """2 var(ddof=1) over m, summed over channels: the mean of |x_i - x_j|^2 over the pairs."""
    apart = samples - samples[:, :1]  # exact for near values, and exactly 0 for equal ones
    apart -= apart.mean(1, keepdims=True)
    return np.einsum("bmchw,bmchw->bhw", apart, apart) * samples.dtype.type(2 / (samples.shape[1] - 1))


def w2_sq_by_pairs(
    means: Float[Array, "n m c h w"], variances: Float[Array, "n m c h w"] | None = None
) -> Float64[Array, "n h w"]:
    """The map of `w2_sq`, pair by pair in float64: the definition, slow."""
    _require_pairs(means.shape[1])
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
    _require_pairs(means.shape[1])
    pairs = list(combinations(range(means.shape[1]), 2))
    total = np.zeros((len(means), *means.shape[3:]), np.float32)
    for i, j in pairs:
        a, b = variances[:, i], variances[:, j]
        total += ((means[:, i] - means[:, j]) ** 2 + (a + b - 2 * np.sqrt(a * b))).sum(1)
    return total / np.float32(len(pairs))


def _require_pairs(m: int) -> None:
    if m < 2:
        raise ValueError(f"disagreement needs at least 2 samples of a pose, not {m}: one has no pair")
