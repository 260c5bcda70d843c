"""Measures of a policy's curve of PSNR against photos."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

WAY = 0.95  # of the way from the start to all photos


def nauc(photos: Float[Array, "t"], psnr: Float[Array, "t"]) -> float:
    """Normalised area under PSNR against photos: its mean over the budget, by the trapezoidal rule, in dB.

    photos: rising, from the start to the budget. Raises: ValueError: fewer than two rounds, photos that do not rise, a
    value that is not finite. Source: nAUC = trapezoid(PSNR, n_0..B) / (B - n_0).
    """
    if len(photos) < 2:
        raise ValueError(f"a curve needs at least two rounds, not {len(photos)}")
    if not (np.diff(photos) > 0).all() or not np.isfinite(psnr).all():
        raise ValueError("a curve's photos must rise from round to round, and its values be finite")
    return float(np.trapezoid(psnr, photos) / (photos[-1] - photos[0]))


def photos_to_reach(photos: Float[Array, "t"], psnr: Float[Array, "t"], best: float, way: float = WAY) -> float | None:
    """Photos until PSNR has risen by the share `way` from the start to `best`, linear between rounds; None if never."""
    goal = psnr[0] + way * (best - psnr[0])
    for t in range(len(photos)):
        if psnr[t] >= goal:
            if t == 0:
                return float(photos[0])
            share = (goal - psnr[t - 1]) / (psnr[t] - psnr[t - 1])
            return float(photos[t - 1] + share * (photos[t] - photos[t - 1]))
    return None
