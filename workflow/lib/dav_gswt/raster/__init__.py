"""Pictures of Gaussians and gradients back: one interface, three backends (`cpu`, `torch`, `cuda`; see `backends`).

`render` draws a field. What fits a field keeps a `Rasterizer` and calls it, `loss` and `adam` thousands of times.
"""

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import backends
from dav_gswt.raster.adapter import to_raster_arrays
from dav_gswt.raster.interface import Contributions, Gradients, Rasterizer, Rendering

__all__ = ["Contributions", "Gradients", "Rasterizer", "Rendering", "adam", "loss", "render", "to_raster_arrays"]


def render(
    field: GaussianField,
    camera: Camera,
    background: float | tuple[float | int, ...] | Float[Array, "c"] = 0.0,
    colours: Float[Array, "n c"] | None = None,
    backend: str | None = None,
    threads: int | None = None,
    *,
    near: float = 0.01,
    dilation: float = 0.3,
    antialiased: bool = False,
) -> Rendering:
    """Draw a field: colour = sum of w_i c_i + (1 - alpha) background, alpha = sum of w_i, depth = sum of w_i z_i.

    background: one value, or one a channel. colours: any number of channels a Gaussian; by default its spherical
    harmonics seen from the camera. backend: by default the one in use. near, dilation, antialiased: see `Rasterizer`.
    Raises: ValueError: an unknown backend, shapes that do not fit, a value that is not finite, with its index.
    """
    shown = field.sh if colours is None else colours
    arrays = (field.means, field.log_scales, field.quats, field.opacity_logits, shown)
    raster = backends.module(backend).Rasterizer(near=near, dilation=dilation, antialiased=antialiased, threads=threads)
    seen = raster.forward(*(np.ascontiguousarray(a, np.float32) for a in arrays), camera=camera)
    behind, channels = np.asarray(background, np.float32), seen.colour.shape[2]
    if behind.shape not in ((), (channels,)):
        raise ValueError(f"background must have one value or {channels}, one a channel, not {behind.size}")
    return Rendering(seen.colour + (1 - seen.alpha)[..., None] * behind, seen.alpha, seen.depth)


def loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None = None,
    structure: float = 0.2,
    threads: int | None = None,
) -> tuple[float, Float32[Array, "h w c"]]:
    """(1 - structure) L1 + structure (1 - SSIM) of the pixels that count, and its gradient by the image.

    By the backend in use; `cpu.loss` says what it is.
    """
    return backends.module().loss(image, target, weight, structure, threads)


def adam(
    values: Float32[Array, "n ..."],
    gradient: Float32[Array, "n ..."],
    first: Float32[Array, "n ..."],
    second: Float32[Array, "n ..."],
    rate: float | Float32[Array, "columns"],
    step: int,
    betas: tuple[float, float] = (0.9, 0.999),
    epsilon: float = 1e-15,
    rows: Bool[Array, "n"] | None = None,
    threads: int | None = None,
) -> None:
    """One step of Adam, in place, by the backend in use; `cpu.adam` says what it is."""
    backends.module().adam(values, gradient, first, second, rate, step, betas, epsilon, rows, threads)
