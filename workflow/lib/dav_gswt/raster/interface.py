"""What every backend takes and gives."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.field import Field
from dav_gswt.raster import harmonics

BACKENDS = ("cpu", "torch")
NEAR = 0.01  # world units: nothing nearer to a camera is drawn
DILATION = 0.3  # square pixels added to every splat's variance, so that none falls between pixels


@dataclass(frozen=True)
class Rendering:
    """A picture. colour: sum of w_i c_i, over black; alpha: sum of w_i; depth: sum of w_i z_i, not divided by alpha."""

    colour: Float[Array, "h w c"]
    alpha: Float[Array, "h w"]
    depth: Float[Array, "h w"]


@dataclass(frozen=True)
class Gradients:
    """Gradients of a loss with respect to what was drawn, shaped like it."""

    means: Float[Array, "n 3"]
    log_scales: Float[Array, "n 3"]
    quats: Float[Array, "n 4"]
    opacity_logits: Float[Array, "n"]
    colours: Float[Array, "n c"]


def render(field: Field, camera: Camera, background=(0.0, 0.0, 0.0), backend: str = "cpu") -> Rendering:
    """A field as a camera sees it, over a background of one colour.

    Colours are the field's spherical harmonics in the direction from the camera, at least 0. The picture is linear in
    the background. Raises: ValueError: unknown backend, or values that are not finite (with the index).
    """
    if backend not in BACKENDS:
        raise ValueError(f"there is no backend {backend!r}; choose from {', '.join(BACKENDS)}")
    from dav_gswt.raster import cpu, torch

    draw = cpu.Rasterizer().forward if backend == "cpu" else torch.forward
    seen = draw(
        field.means,
        field.log_scales,
        field.quats,
        field.opacity_logits,
        harmonics.colours(field.sh, field.means, camera),
        camera,
    )
    behind = np.asarray(background, seen.colour.dtype)
    return Rendering(seen.colour + (1 - seen.alpha)[..., None] * behind, seen.alpha, seen.depth)
