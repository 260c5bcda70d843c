"""Fisher information that a photo gives about the colours of a field's Gaussians.

A pixel's colour is the sum of w_i c_i, so its derivative by the colour c_i is the blend weight w_i, and the diagonal of
the information of a picture is H_i = sum over pixels of w_i^2, equal in all channels.
"""

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.raster.interface import Contributions

PRIOR = 1.0  # information on each Gaussian before any photo: one pixel that it covers fully


def accumulate_information(field: GaussianField, cameras: list[Camera], raster: Rasterizer) -> Float64[Array, "n"]:
    """Sum the information of captured photos on each Gaussian, plus PRIOR."""
    total = np.full(len(field), PRIOR)
    for camera in cameras:
        raster.forward(**to_raster_arrays(field), camera=camera)
        total += raster.contributions().squared
    return total


def information_gain(contributions: Contributions, known: Float64[Array, "n"]) -> float:
    """Information gain of a photo: the trace of H (H_known)^-1, both diagonal.

    Source: Jiang et al., FisherRF, ECCV 2024, for colours only.
    """
    return float((contributions.squared / known).sum())
