"""Pixels that the fit never sees, to know whether colours that change with direction are worth their cost."""

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.images.metrics import mse_to_psnr

SHARE = 0.04  # of the pixels
# Pixels a side of what is held out at once: within fewer the photo itself tells what is there, which no new view can.
# Desert, for development, 300 to 450 steps with twice the Gaussians: new views gain .10 dB; 32: +.14, 8: -.07.
BLOCK = 32
GAIN = 0.05  # dB that a degree of the spherical harmonics must bring


def mask(height: int, width: int, rng: np.random.Generator) -> Bool[Array, "h w"]:
    """Blocks of pixels that are held out, at least one."""
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    count = max(1, round(SHARE * rows * columns))
    out = np.zeros(rows * columns, bool)
    out[rng.choice(rows * columns, count, replace=False)] = True
    return out.reshape(rows, columns).repeat(BLOCK, 0).repeat(BLOCK, 1)[:height, :width]


class Tally:
    """Squared error over the held-out pixels of all views."""

    def __init__(self):
        self.error, self.count = 0.0, 0.0

    def note(self, picture: Float32[Array, "h w 3"], photo: Float32[Array, "h w 3"], weight: Array) -> None:
        """Take a view's picture. weight: of its held-out pixels."""
        self.error += float((((picture - photo).astype(float) ** 2).mean(-1) * weight).sum())
        self.count += float(weight.sum())

    @property
    def psnr(self) -> float:
        """100 where nothing is wrong, or nothing counts."""
        found = mse_to_psnr(max(self.error / max(self.count, 1e-9), 1e-10))
        assert found is not None  # the error is above 0
        return found
