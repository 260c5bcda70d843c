"""The rasterizer on an NVIDIA GPU, by gsplat (the extra `cuda`; written for version 1.5).

Tests run on the CPU, with a stand-in for gsplat. gsplat shares this library's conventions (pixel centres at half
integers, covariance plus dilation, 1/255, 1e-4, the rim at which the projection is linearised, harmonics), but for:
- alpha is clamped at .999, not .99: a weight may differ by .009 where opacities exceed .99, else by float32 roundings.
- covariances are inverted by differences of large numbers in float32: a splat a thousand times as long as wide keeps
  about three digits, and standard deviations beyond 1e18 pixels or units none.
- sums are atomic: two runs differ in the last bits.
Each call copies arrays to the GPU and back; `adam` runs on the CPU.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import gsplat  # pyright: ignore[reportMissingImports]  an extra
import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import interface, oracle
from dav_gswt.raster.interface import Contributions, Forward, GaussianArrays, Gradients, PictureGradients, Rendering
from dav_gswt.raster.torch import adam, compute_loss, join_gradients, split_channels, to_gradients

__all__ = ["Rasterizer", "adam", "loss"]

ALPHA_MAX = 0.999  # gsplat's
ANY_DEPTH = 1e-37, 3e38  # near and far plane that keep all before the camera: the limits of float32


@dataclass(frozen=True)
class GsplatForward:
    """A forward pass of gsplat: its autograd graph and intermediate results."""

    leaves: dict[str, Tensor]
    view: Float32[Tensor, "4 4"]
    picture: Float32[Tensor, "1 h w c"]
    alpha: Float32[Tensor, "1 h w 1"]
    meta: dict[str, Any]


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`. device: where gsplat runs. threads: not used."""

    def __init__(
        self,
        near: float = 0.01,
        dilation: float = 0.3,
        antialiased: bool = False,
        threads: int | None = None,
        device: str = "cuda",
    ):
        super().__init__(near, dilation, antialiased, threads)
        self.device = torch.device(device)

    @torch.enable_grad()
    def _render(self, gaussians: GaussianArrays, camera: Camera) -> tuple[Rendering, Any]:
        interface.find_invalid(gaussians)
        given = gaussians.by_name()
        given["means"] = (given["means"].astype(float) - camera.centre).astype(np.float32)  # R m + t cancels far out
        leaves = {name: torch.tensor(array, device=self.device).requires_grad_() for name, array in given.items()}
        view = torch.eye(4, device=self.device)
        view[:3, :3] = torch.as_tensor(np.asarray(camera.rotation))
        view.requires_grad_()
        picture, alpha, meta = self._call_gsplat(leaves, view, camera)
        c = gaussians.colours.shape[-1]
        channels = torch.cat([picture[0, ..., :c], alpha[0], picture[0, ..., -1:], picture[0, ..., c:-1]], 2)
        rendering = split_channels(channels, c, gaussians.features is not None)
        return rendering, GsplatForward(leaves, view, picture, alpha, meta)

    def _differentiate(self, last: Forward, given: PictureGradients) -> Gradients:
        state = last.state
        by_channel = join_gradients(last.rendering, given).to(self.device)
        c = last.rendering.colour.shape[2]
        by_picture = torch.cat([by_channel[..., :c], by_channel[..., c + 2 :], by_channel[..., c + 1 : c + 2]], 2)
        found = torch.autograd.grad(
            (state.picture, state.alpha),
            (*state.leaves.values(), state.view),
            (by_picture[None], by_channel[None, ..., c : c + 1]),
            retain_graph=True,
            materialize_grads=True,
        )
        by_camera = motion_gradient(state.view.detach(), found[-1])
        return to_gradients(dict(zip(state.leaves, found[:-1], strict=True)) | {"camera": by_camera})

    def _contribute(self, last: Forward, weights: Float32[Array, "h w c"]) -> Contributions:
        state = last.state
        h, w = last.camera.height, last.camera.width
        with torch.no_grad():
            gaussians, pixels, blend = list_pairs(state.meta, w, h)
            maps = torch.as_tensor(weights, device=self.device).reshape(h * w, -1)
            n = len(state.leaves["means"])
            zero = torch.zeros(n, device=self.device)
            total = zero.index_add(0, gaussians, blend)
            maximum = zero.scatter_reduce(0, gaussians, blend, "amax")
            mapped = [zero.index_add(0, gaussians, blend * m[pixels]) for m in maps.T]
        table = torch.stack(mapped, 1) if mapped else zero[:, None][:, :0]
        return Contributions(*(a.cpu().numpy() for a in (total, maximum, table)))

    def _visible(self, last: Forward) -> Bool[Array, "n"]:
        return (last.state.meta["radii"][0] > 0).all(-1).cpu().numpy()

    def _call_gsplat(self, leaves: dict[str, Tensor], view: Float32[Tensor, "4 4"], camera: Camera):
        """gsplat's picture (colours, features, depth), alpha and intermediate results."""
        colours, features, degree = leaves["colours"], leaves.get("features"), None
        if colours.ndim == 3:
            if features is None and not camera.orthographic:
                degree = int(colours.shape[1] ** 0.5) - 1
            else:  # gsplat takes no features beside harmonics, and would see an orthographic picture from one point
                colours = oracle.seen_from(colours, leaves["means"], camera, (view[:3, :3], view[:3, 3]))
        values = colours if features is None else torch.cat([colours, features], 1)
        quats = leaves["quats"]
        near, far = ANY_DEPTH
        inner = [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
        return gsplat.rasterization(
            leaves["means"],
            quats / quats.detach().abs().amax(1, keepdim=True),  # gsplat squares them: 1e30 would be too much
            leaves["log_scales"].exp(),
            torch.sigmoid(leaves["opacity_logits"]),
            values,
            view[None],
            torch.tensor(inner, device=view.device)[None],
            camera.width,
            camera.height,
            near_plane=near if camera.orthographic else self.near,
            far_plane=far,
            eps2d=self.dilation,
            sh_degree=degree,
            packed=False,
            render_mode="RGB+D",
            rasterize_mode="antialiased" if self.antialiased else "classic",
            camera_model="ortho" if camera.orthographic else "pinhole",
        )


def motion_gradient(view: Float[Tensor, "4 4"], by_view: Float[Tensor, "4 4"]) -> Float[Tensor, "6"]:
    """dL by the camera's small motion q' = exp([w]x) q + tau from dL by the matrix V of q = V (p, 1).

    A column v of V moves by w x v, the last one by tau too: dL/dw = sum over columns of v x dL/dv.
    """
    v, g = (m[:3].double() for m in (view, by_view))
    return torch.cat([torch.linalg.cross(v.T, g.T).sum(0), g[:, 3]])


def list_pairs(
    meta: dict[str, Any], width: int, height: int
) -> tuple[Int[Tensor, "m"], Int[Tensor, "m"], Float32[Tensor, "m"]]:
    """Every Gaussian that a pixel blends, pixel after pixel from front to back: Gaussian, pixel, blend weight.

    The weight is alpha times the product of 1 - alpha over those before it in the same pixel, as the difference of two
    entries of one running sum of logarithms (float64: it runs over the whole picture).
    """
    means, conics, opacities = (meta[name] for name in ("means2d", "conics", "opacities"))
    clear = torch.ones(1, height, width, device=means.device)
    gaussians, pixels, _ = gsplat.rasterize_to_indices_in_range(
        0, 1 << 30, clear, means, conics, opacities, width, height,
        meta["tile_size"], meta["isect_offsets"], meta["flatten_ids"],
    )  # fmt: skip
    gaussians, pixels = gaussians.long(), pixels.long()
    d = means[0, gaussians] - torch.stack([pixels % width, pixels // width], 1) - 0.5
    a, b, c = conics[0, gaussians].unbind(1)
    exponent = 0.5 * (a * d[:, 0] ** 2 + c * d[:, 1] ** 2) + b * d[:, 0] * d[:, 1]
    alpha = (opacities[0, gaussians] * torch.exp(-exponent)).clamp(max=ALPHA_MAX)
    passed = torch.log1p(-alpha.double())
    before = torch.cumsum(passed, 0) - passed
    place = torch.arange(len(pixels), device=pixels.device)
    begins = torch.ones_like(pixels, dtype=torch.bool)
    begins[1:] = pixels[1:] != pixels[:-1]
    first = torch.cummax(torch.where(begins, place, 0), 0).values if len(place) else place
    return gaussians, pixels, (alpha * torch.exp(before - before[first])).float()


loss = interface.Loss(partial(compute_loss, torch.device("cuda")))
