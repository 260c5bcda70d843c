"""Back-projection of uncertainty maps onto Gaussians: each gets the weighted mean of the pixels that show it."""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images.image_files import enlarge_map
from dav_gswt.raster import Rasterizer, to_raster_arrays

SIDE = 64  # pixels of the pictures from which blend weights are computed
SEEN = 0.05  # total blend weight, in pixels, from which a Gaussian counts as seen


def backproject_maps(
    field: GaussianField, cameras: list[Camera], maps: Float32[Array, "n h w"]
) -> Float32[Array, "gaussians"]:
    """Mean of u over cameras and pixels, weighted by blend weight: sum of w_i(p) u(p) / sum of w_i(p).

    cameras: of square pictures, which the maps cover at any resolution. Rendered like a colour, the result gives the
    uncertainty of any other view. Returns: NaN for Gaussians that are not seen.
    """
    raster = Rasterizer()
    total = np.zeros((2, len(field)))
    for camera, u in zip(cameras, maps, strict=True):
        raster.forward(**to_raster_arrays(field), camera=camera.resized(SIDE, SIDE))
        found = raster.contributions(enlarge_map(u, SIDE, SIDE)[..., None])
        total += found.mapped[:, 0], found.total
    weighted, weight = total
    return np.where(weight > SEEN, weighted / np.maximum(weight, SEEN), np.nan).astype(np.float32)
