"""What the photos of the last steps show wrong of each Gaussian, to know where more are needed."""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.raster import Rasterizer


class Residual:
    """Squared error carried back onto the Gaussians by their blend weights, and how many photos had a part in it.

    Empty arrays: nothing was noted yet.
    """

    def __init__(self):
        self.errors, self.photos = np.zeros(0, np.float32), np.zeros(0, np.int32)

    def note(self, drawn: Rasterizer, apart: Float32[Array, "h w 3"], weight: Float32[Array, "h w"]) -> None:
        """Take the picture that `drawn` has drawn last. apart: it less the photo; weight: pixels that count."""
        squared = np.ascontiguousarray(((apart**2).mean(-1) * weight)[..., None], np.float32)
        found = drawn.contributions(squared).mapped[:, 0]
        if not len(self.errors):
            self.errors, self.photos = np.zeros_like(found), np.zeros(len(found), np.int32)
        self.errors += found
        self.photos += found > 0

    @property
    def of_a_photo(self) -> float:
        """Squared error, summed over all Gaussians, each as one of the photos that see it shows it on average."""
        return float((self.errors / np.maximum(self.photos, 1)).sum(dtype=float))
