"""Pictures of a Gaussian field: one interface, a C++ core for the CPU (`cpu`) and a float64 oracle (`torch`).

`render` draws a field. What fits a field calls `cpu.Rasterizer` itself, thousands of times.
"""

import importlib

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.field import Field
from dav_gswt.raster import cpu, harmonics
from dav_gswt.raster.cpu import Contributions, Gradients, Rasterizer, Rendering

__all__ = ["Contributions", "Gradients", "Rasterizer", "Rendering", "render"]

BACKENDS = ("cpu", "torch")


def render(
    field: Field,
    camera: Camera,
    background: float | tuple[float | int, ...] | Float[Array, "c"] = 0.0,
    colours: Float[Array, "n c"] | None = None,
    backend: str = "cpu",
    threads: int | None = None,
    *,
    near: float = 0.01,
    dilation: float = 0.3,
) -> Rendering:
    """Draw a field: colour = sum of w_i c_i + (1 - alpha) background, alpha = sum of w_i, depth = sum of w_i z_i.

    background: one value, or one a channel. colours: any number of channels a Gaussian; by default its spherical
    harmonics seen from the camera. near, dilation: see `cpu.Rasterizer`.
    Raises: ValueError: an unknown backend, shapes that do not fit, a value that is not finite, with its index.
    """
    if backend not in BACKENDS:
        raise ValueError(f"no backend '{backend}': choose from {', '.join(BACKENDS)}")
    if colours is None:
        colours = harmonics.colours(field.sh, harmonics.directions(field.means, camera))
    arrays = [field.means, field.log_scales, field.quats, field.opacity_logits, colours]
    arrays = [np.ascontiguousarray(a, np.float32) for a in arrays]
    if backend == "cpu":
        seen = cpu.Rasterizer(near=near, dilation=dilation, threads=threads).forward(*arrays, camera=camera)
    else:
        oracle = importlib.import_module("dav_gswt.raster.torch")  # only who asks for it waits for torch
        seen = oracle.rendered(*arrays, camera=camera, near=near, dilation=dilation)
    behind, channels = np.asarray(background, np.float32), seen.colour.shape[2]
    if behind.shape not in ((), (channels,)):
        raise ValueError(f"background must have one value or {channels}, one a channel, not {behind.size}")
    return Rendering(seen.colour + (1 - seen.alpha)[..., None] * behind, seen.alpha, seen.depth)
