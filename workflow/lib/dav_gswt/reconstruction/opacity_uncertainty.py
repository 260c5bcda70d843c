"""Uncertainty of a Gaussian without a prior: one minus the opacity that the photos' cameras see where it is.

It is 1 where no photo looks and near 0 where the surface is closed. Rendered like a colour it is the uncertainty of a
pixel: sum of w_i u_i + transmittance.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import Rasterizer, to_raster_arrays

MIN_WEIGHT = 0.05  # pixels of blend weight from which a photo counts as seeing a Gaussian


def estimate_uncertainty(field: GaussianField, views: list[TrainingView]) -> GaussianField:
    """The field with uncertainty u_i = 1 - max over views of (sum of w_i alpha / sum of w_i), 1 where none sees it."""
    known = np.zeros(len(field), np.float32)
    raster = Rasterizer()
    for view in one_by_one(views):
        seen = raster.forward(**to_raster_arrays(field), camera=view.camera)
        maps = np.stack([view.weight * seen.alpha, view.weight], -1).astype(np.float32)
        opaque, weight = raster.contributions(maps).mapped.T
        share = np.where(weight > MIN_WEIGHT, opaque / np.maximum(weight, MIN_WEIGHT), 0)
        known = np.maximum(known, share)
    return replace(field, uncertainty=np.clip(1 - known, 0, 1).astype(np.float32))


def render_uncertainty(field: GaussianField, camera: Camera, raster: Rasterizer) -> Float32[Array, "h w"]:
    """Uncertainty of each pixel: blend-weighted, plus the transmittance, where nothing is known."""
    seen = raster.forward(**to_raster_arrays(field, field.uncertainty[:, None]), camera=camera)
    return np.clip(seen.colour[..., 0] + 1 - seen.alpha, 0, 1)
