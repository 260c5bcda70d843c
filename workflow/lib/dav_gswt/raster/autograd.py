"""The rasterizer as a differentiable function of PyTorch tensors, by any backend."""

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor
from torch.autograd.function import once_differentiable

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import backends


def rasterize(
    means: Float[Tensor, "n 3"],
    log_scales: Float[Tensor, "n 3"],
    quats: Float[Tensor, "n 4"],
    opacity_logits: Float[Tensor, "n"],
    colours: Float[Tensor, "n c"] | Float[Tensor, "n k 3"],
    camera: Camera,
    features: Float[Tensor, "n f"] | None = None,
    motion: Float[Tensor, "6"] | None = None,
    backend: str | None = None,
    **options,
) -> tuple[Tensor, ...]:
    """Colour, alpha, depth and, with features, theirs, over black; see `interface.Rasterizer.forward`.

    motion: six zeros, whose gradient is that by a small motion of the camera (`interface.Gradients.camera`).
    backend: by default the one in use. options: of its Rasterizer (near, dilation, antialiased, threads).
    It renders in float32 on NumPy arrays; images and gradients have the type and device of `means` and of each
    parameter. Differentiable once.
    Raises: ValueError: as `Rasterizer.forward`, or a motion that is not zero.
    """
    if motion is not None and motion.detach().abs().sum() > 0:
        raise ValueError("motion must be zero: move the camera itself, then ask for the gradient there")
    raster = backends.load_backend(backend).Rasterizer(**options)
    images = _Rasterize.apply(raster, camera, motion, means, log_scales, quats, opacity_logits, colours, features)
    return images if features is not None else images[:3]


class _Rasterize(torch.autograd.Function):
    """Each call has a rasterizer of its own, which keeps the state of its backward pass."""

    @staticmethod
    def forward(ctx, raster, camera, motion, *parameters):
        arrays = [None if p is None else _to_array(p) for p in parameters]
        seen = raster.forward(*arrays[:5], camera=camera, features=arrays[5])
        ctx.raster, ctx.like = raster, (motion, *parameters)
        images = (seen.colour, seen.alpha, seen.depth, seen.features)
        return tuple(None if i is None else torch.from_numpy(i.copy()).to(parameters[0]) for i in images)

    @staticmethod
    @once_differentiable
    def backward(ctx, *image_gradients):  # pyright: ignore[reportIncompatibleMethodOverride]  @once_differentiable
        found = ctx.raster.backward(*(None if g is None else _to_array(g) for g in image_gradients))
        parts = (found.camera, *(getattr(found, name) for name in _NAMES))
        pairs = zip(parts, ctx.like, strict=True)
        return None, None, *(None if like is None else torch.from_numpy(g.copy()).to(like) for g, like in pairs)


_NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours", "features")


def _to_array(tensor: Tensor) -> np.ndarray:
    return np.ascontiguousarray(tensor.detach().cpu().numpy(), np.float32)
