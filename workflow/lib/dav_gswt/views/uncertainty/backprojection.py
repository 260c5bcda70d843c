"""Uncertainty from pictures onto what they show: each Gaussian gets the mean of the pixels that it is seen in."""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images.image_files import enlarge_map
from dav_gswt.raster import Rasterizer, to_raster_arrays

SIDE = 64  # pixels of the pictures whose blend weights are taken
SEEN = 0.05  # pixels of blend weight, over all pictures, from which a Gaussian counts as seen


def backproject_maps(
    field: GaussianField, cameras: list[Camera], maps: Float32[Array, "n h w"]
) -> Float32[Array, "gaussians"]:
    """Mean over cameras and pixels of u, weighted by blend weight: sum of w_i(p) u(p) / sum of w_i(p); NaN where a
    Gaussian is not seen.

    cameras: of square pictures, which the maps cover in whatever resolution. Drawn like a colour, what is carried gives
    the uncertainty of any other view.
    """
    raster = Rasterizer()
    total = np.zeros((2, len(field)))
    for camera, u in zip(cameras, maps, strict=True):
        raster.forward(**to_raster_arrays(field), camera=camera.resized(SIDE, SIDE))
        found = raster.contributions(enlarge_map(u, SIDE, SIDE)[..., None])
        total += found.mapped[:, 0], found.total
    weighted, weight = total
    return np.where(weight > SEEN, weighted / np.maximum(weight, SEEN), np.nan).astype(np.float32)
