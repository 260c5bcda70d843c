"""Differentiable rendering of Gaussians: one interface, three backends (`cpu`, `torch`, `cuda`; see `backends`).

`render` renders a field once. A fit keeps a rasterizer (`make_rasterizer`) and calls it, `loss` and `adam`
at each step.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images.channels import composite
from dav_gswt.raster.backends import adam, loss, make_rasterizer
from dav_gswt.raster.interface import Contributions, Gradients, Rasterizer, Rendering, to_raster_arrays

__all__ = [
    "Contributions",
    "Gradients",
    "Rasterizer",
    "Rendering",
    "adam",
    "loss",
    "make_rasterizer",
    "render",
    "to_raster_arrays",
]


def render(
    field: GaussianField, camera: Camera, background: float | tuple[float | int, ...] | Float[Array, "c"] = 0.0
) -> Rendering:
    """Render a field: colour = sum of w_i c_i + (1 - alpha) background, alpha = sum of w_i, depth = sum of w_i z_i.

    background: one value, or one a channel.
    Raises: ValueError: a value of the field that is not finite, with its index.
    """
    arrays = to_raster_arrays(field)
    seen = make_rasterizer().forward(
        **{k: np.ascontiguousarray(a, np.float32) for k, a in arrays.items()}, camera=camera
    )
    behind = np.broadcast_to(np.asarray(background, np.float32), seen.colour.shape[2])
    return Rendering(composite(seen.colour, seen.alpha, behind), seen.alpha, seen.depth)
