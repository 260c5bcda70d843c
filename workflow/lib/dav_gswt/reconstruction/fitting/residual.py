"""The residual of the last photos projected back onto the Gaussians, to know where more are needed."""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.images import channels
from dav_gswt.raster import Rasterizer


class Residual:
    """Squared error projected back onto the Gaussians by blend weights, and the number of photos that contributed.

    The arrays are empty before the first photo.
    """

    def __init__(self):
        self.errors, self.photos = np.zeros(0, np.float32), np.zeros(0, np.int32)

    def add(self, rasterizer: Rasterizer, difference: Float32[Array, "h w 3"], weight: Float32[Array, "h w"]) -> None:
        """Add the last picture of the rasterizer. difference: picture less photo. weight: pixels that count."""
        squared = (channels.mean_squares(difference) * weight)[..., None]
        self.add_found(rasterizer.contributions(squared).mapped[:, 0])

    def add_found(self, found: Float32[Array, "n"]) -> None:
        """Add the errors that a photo projects back."""
        if not len(self.errors):
            self.errors, self.photos = np.zeros_like(found), np.zeros(len(found), np.int32)
        self.errors += found
        self.photos += found > 0

    @property
    def error_per_photo(self) -> float:
        """Squared error summed over all Gaussians, for each its mean over the photos that see it."""
        return float((self.errors / np.maximum(self.photos, 1)).sum(dtype=float))
