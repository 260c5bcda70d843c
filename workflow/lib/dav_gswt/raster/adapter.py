"""From a Gaussian field to the arrays that a rasterizer draws."""

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField


def to_raster_arrays(
    field: GaussianField, colours: Float32[Array, "n c"] | None = None
) -> dict[str, Float[Array, "..."]]:
    """Keyword arguments of `Rasterizer.forward`. colours: channels to draw instead of the spherical harmonics."""
    return {
        "means": field.means,
        "log_scales": field.log_scales,
        "quats": field.quats,
        "opacity_logits": field.opacity_logits,
        "colours": np.ascontiguousarray(field.sh if colours is None else colours, np.float32),
    }
