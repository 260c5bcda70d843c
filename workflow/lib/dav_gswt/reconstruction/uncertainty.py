"""What is known of each Gaussian: one minus the opacity that the captured photos' cameras see where it is.

Until a prior says more this is the uncertainty of a Gaussian: 1 where no photo looks, near 0 where the ground is
closed. A map of it, drawn like a colour, is the uncertainty of a pixel: sum of w_i u_i + what light passes through.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.photos.training_views import View
from dav_gswt.raster import Rasterizer

SEEN = 0.05  # pixels of blend weight from which a photo counts as seeing a Gaussian


def with_uncertainty(field: GaussianField, views: list[View]) -> GaussianField:
    """The field with uncertainty u_i = 1 - max over views of (sum of w_i alpha / sum of w_i), 1 where none sees it."""
    known = np.zeros(len(field), np.float32)
    raster = Rasterizer()
    for view in views:
        seen = raster.forward(**arrays(field), camera=view.camera)
        maps = np.stack([view.weight * seen.alpha, view.weight], -1).astype(np.float32)
        opaque, weight = raster.contributions(maps).mapped.T
        share = np.where(weight > SEEN, opaque / np.maximum(weight, SEEN), 0)
        known = np.maximum(known, share)
    return replace(field, uncertainty=np.clip(1 - known, 0, 1).astype(np.float32))


def uncertainty_map(field: GaussianField, camera: Camera, raster: Rasterizer) -> Float32[Array, "h w"]:
    """Per pixel: blend-weighted uncertainty of what is seen, plus the transmittance (nothing at all is known there)."""
    seen = raster.forward(**arrays(field, field.uncertainty[:, None]), camera=camera)
    return np.clip(seen.colour[..., 0] + 1 - seen.alpha, 0, 1)


def arrays(field: GaussianField, colours: Float32[Array, "n c"] | None = None) -> dict[str, Float[Array, "..."]]:
    """A field's arrays as the rasterizer takes them; colours: something else to draw than its spherical harmonics."""
    return {
        "means": field.means,
        "log_scales": field.log_scales,
        "quats": field.quats,
        "opacity_logits": field.opacity_logits,
        "colours": np.ascontiguousarray(field.sh if colours is None else colours, np.float32),
    }
