"""Held-out pixels, to decide whether view-dependent colours are worth their cost."""

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.images.metrics import mse_to_psnr

SHARE = 0.04  # of the pixels
BLOCK = 32  # pixels a side of a held-out block: smaller ones are interpolated from their surroundings
MIN_GAIN = 0.05  # dB that a degree of the spherical harmonics must gain


def draw_mask(height: int, width: int, rng: np.random.Generator) -> Bool[Array, "h w"]:
    """A random mask of held-out blocks, at least one."""
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    count = max(1, round(SHARE * rows * columns))
    out = np.zeros(rows * columns, bool)
    out[rng.choice(rows * columns, count, replace=False)] = True
    return out.reshape(rows, columns).repeat(BLOCK, 0).repeat(BLOCK, 1)[:height, :width]


class ErrorSum:
    """Squared error over the held-out pixels of all views."""

    def __init__(self):
        self.error, self.count = 0.0, 0.0

    def add(self, picture: Float32[Array, "h w 3"], photo: Float32[Array, "h w 3"], weight: Array) -> None:
        """Add a view's picture. weight: of its held-out pixels."""
        self.error += float((((picture - photo).astype(float) ** 2).mean(-1) * weight).sum())
        self.count += float(weight.sum())

    @property
    def psnr(self) -> float:
        """In dB; 100 for equal pictures or without pixels."""
        found = mse_to_psnr(max(self.error / max(self.count, 1e-9), 1e-10))
        assert found is not None  # the error is above 0
        return found
