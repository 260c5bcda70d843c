"""Texture of the picture that a prior expects at a pose: the gradient term of the paper's u_img, an ablation.

It measures texture, not uncertainty: sharp, certain grass scores high.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Float32, Float64
from numpy import ndarray as Array

from dav_gswt.views.uncertainty.finite import require_finite

LUMINANCE = 0.2126, 0.7152, 0.0722  # of Rec. 709's red, green and blue
CHUNK = 1 << 20  # values per chunk


def image_gradient(
    pictures: Float32[Array, "n m h w 3"], squared: bool = False, names: Sequence[str] | None = None
) -> Float64[Array, "n"]:
    """Mean over pixels of the gradient's 2-norm, of the mean of the m pictures decoded at each pose; per pixel step.

    squared: of the norm's square, as the paper's appendix has it.
    Returns: 0 for a constant picture; a times as much (a^2 where squared) for pictures times a.
    Raises: ValueError: no picture, a side under 2 pixels, a value that is not finite, naming the poses.
    Source: DAV-GSWT, Eq. (uncert_img), its first term.
    """
    n, m, h, w, _ = pictures.shape
    if m < 1 or min(h, w) < 2:
        raise ValueError(f"a gradient needs at least one picture of 2 x 2 pixels, not {m} of {w} x {h}")
    found = np.empty(n)
    step = max(1, CHUNK // (m * h * w * 3))
    for start in range(0, n, step):
        rows = slice(start, start + step)
        with np.errstate(invalid="ignore"):  # rejected below
            slope = gradient_map(pictures[rows].mean(1, dtype=np.float64) @ np.array(LUMINANCE))
        found[rows] = (slope**2 if squared else slope).mean((1, 2))
    require_finite(found, "the decoded pictures", names)
    return found


def gradient_map(values: Float64[Array, "n h w"]) -> Float64[Array, "n h w"]:
    """Norm of the gradient by the Sobel operator over 8, with reflection at the border."""
    padded = np.pad(values, ((0, 0), (1, 1), (1, 1)), mode="reflect")
    return np.hypot(_along(padded, 2), _along(padded, 1))


def _along(padded: Float[Array, "n _ _"], axis: int) -> Float[Array, "n _ _"]:
    """Central difference along an axis, smoothed by 1 2 1 along the other; without the border."""
    x = np.moveaxis(padded, axis, -1)
    difference = x[..., 2:] - x[..., :-2]
    smooth = difference[:, :-2] + 2 * difference[:, 1:-1] + difference[:, 2:]
    return np.moveaxis(smooth, -1, axis) / 8
