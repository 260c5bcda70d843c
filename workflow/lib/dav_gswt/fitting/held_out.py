"""Pixels that the fit never sees, to know whether more steps, more Gaussians or richer colours are worth their cost."""

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

SHARE = 0.04  # of the pixels
BLOCK = 8  # pixels a side of what is held out at once: a lone pixel is known from its neighbours
GAIN = 0.02  # dB that WINDOW steps must bring
WINDOW = 100


def mask(height: int, width: int, rng: np.random.Generator) -> Bool[Array, "h w"]:
    """Blocks of pixels that are held out, at least one."""
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    count = max(1, round(SHARE * rows * columns))
    out = np.zeros(rows * columns, bool)
    out[rng.choice(rows * columns, count, replace=False)] = True
    return out.reshape(rows, columns).repeat(BLOCK, 0).repeat(BLOCK, 1)[:height, :width]


class Tally:
    """The latest squared error of every view's held-out pixels."""

    def __init__(self, views: int):
        self.error, self.count = np.zeros(views), np.zeros(views)

    def note(self, view: int, picture: Float32[Array, "h w 3"], photo: Float32[Array, "h w 3"], weight: Array) -> None:
        """Take the error of a view's picture at this step. weight: of its held-out pixels."""
        self.error[view] = float((((picture - photo).astype(float) ** 2).mean(-1) * weight).sum())
        self.count[view] = float(weight.sum())

    @property
    def psnr(self) -> float:
        """Over all views; 100 where nothing is wrong, or nothing counts."""
        return float(-10 * np.log10(max(self.error.sum() / max(self.count.sum(), 1e-9), 1e-10)))
