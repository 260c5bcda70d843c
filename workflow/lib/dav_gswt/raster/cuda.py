"""The rasterizer on an NVIDIA GPU, by gsplat (the extra `cuda`; written against its version 1.5).

Figures on a GPU, of speed and of agreement, are not taken yet: what is tested is everything on this side of gsplat.
gsplat shares our conventions (pixel centres at half integers, covariance plus dilation, 1/255, 1e-4, the rim at which
the projection is linearised, harmonics), with these differences:
- alpha stops at .999, ours at .99: where opacities exceed .99 a weight may differ by .009, else by float32 roundings.
- covariances are inverted with differences of large numbers, in float32: a splat a thousand times as long as wide keeps
  some three digits, and standard deviations beyond 1e18 pixels or units none.
- sums are atomic: two runs differ in the last bits.
Arrays travel to the GPU and back in each call; `adam` runs where they are, on the CPU.
"""

from dataclasses import dataclass

import gsplat
import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import interface, oracle
from dav_gswt.raster.interface import Contributions, Gradients, Rendering
from dav_gswt.raster.torch import NAMES, adam, apart, gradients_of, loss_on, together

__all__ = ["Rasterizer", "adam", "loss"]

ALPHA_MAX = 0.999  # gsplat's
ANY_DEPTH = 1e-37, 3e38  # near and far plane that leave out nothing before the camera: the ends of float32


@dataclass(frozen=True)
class Drawn:
    """What backward and contributions need of a forward."""

    camera: Camera
    leaves: dict[str, Tensor]
    view: Float32[Tensor, "4 4"]
    picture: Float32[Tensor, "1 h w c"]
    alpha: Float32[Tensor, "1 h w 1"]
    images: tuple[Array, ...]
    meta: dict


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`. device: where gsplat draws. threads mean nothing here."""

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
    def forward(
        self,
        means: Float32[Array, "n 3"],
        log_scales: Float32[Array, "n 3"],
        quats: Float32[Array, "n 4"],
        opacity_logits: Float32[Array, "n"],
        colours: Float32[Array, "n c"] | Float32[Array, "n k 3"],
        camera: Camera,
        features: Float32[Array, "n f"] | None = None,
    ) -> Rendering:
        arrays = dict(zip(NAMES, (means, log_scales, quats, opacity_logits, colours, features), strict=True))
        interface.check_camera(camera)
        interface.check_gaussians(arrays)
        self._last = None
        given = {name: array for name, array in arrays.items() if array is not None}
        leaves = {name: torch.tensor(array, device=self.device).requires_grad_() for name, array in given.items()}
        view = torch.eye(4, device=self.device)
        view[:3, :3] = torch.as_tensor(np.asarray(camera.rotation))
        view[:3, 3] = torch.as_tensor(np.asarray(camera.translation))
        view.requires_grad_()
        picture, alpha, meta = self._by_gsplat(leaves, view, camera)
        c = colours.shape[-1]
        whole = torch.cat([picture[0, ..., :c], alpha[0], picture[0, ..., -1:], picture[0, ..., c:-1]], 2)
        images = apart(whole, c, features is not None)
        self._last = Drawn(camera, leaves, view, picture, alpha, images, meta)
        return Rendering(*images)

    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
        grad_features: Float32[Array, "h w f"] | None = None,
    ) -> Gradients:
        last: Drawn = self._forwarded()
        whole = together(last.images, (grad_colour, grad_alpha, grad_depth, grad_features)).to(self.device)
        c = last.images[0].shape[2]
        by_picture = torch.cat([whole[..., :c], whole[..., c + 2 :], whole[..., c + 1 : c + 2]], 2)
        found = torch.autograd.grad(
            (last.picture, last.alpha),
            (*last.leaves.values(), last.view),
            (by_picture[None], whole[None, ..., c : c + 1]),
            retain_graph=True,
            materialize_grads=True,
        )
        by_camera = motion_of(last.view.detach(), found[-1])
        return gradients_of(dict(zip(last.leaves, found[:-1], strict=True)) | {"camera": by_camera})

    def contributions(self, weights: Float32[Array, "h w c"] | None = None) -> Contributions:
        last: Drawn = self._forwarded()
        h, w = last.camera.height, last.camera.width
        weights = np.empty((h, w, 0), np.float32) if weights is None else weights
        interface.check(weights, "weights", (h, w, interface.columns(weights)))
        with torch.no_grad():
            gaussians, pixels, blend = pairs(last.meta, w, h)
            maps = torch.as_tensor(weights, device=self.device).reshape(h * w, -1)
            n = len(last.leaves["means"])
            zero = torch.zeros(n, device=self.device)
            total, squared = (zero.index_add(0, gaussians, value) for value in (blend, blend * blend))
            most = zero.scatter_reduce(0, gaussians, blend, "amax")
            mapped = [zero.index_add(0, gaussians, blend * m[pixels]) for m in maps.T]
        mapped = torch.stack(mapped, 1) if mapped else zero[:, None][:, :0]
        return Contributions(*(a.cpu().numpy() for a in (total, squared, most, mapped)))

    @property
    def drawn(self) -> Bool[Array, "n"]:
        return (self._forwarded().meta["radii"][0] > 0).all(-1).cpu().numpy()

    def _by_gsplat(self, leaves: dict[str, Tensor], view: Float32[Tensor, "4 4"], camera: Camera):
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


def motion_of(view: Float[Tensor, "4 4"], by_view: Float[Tensor, "4 4"]) -> Float[Tensor, "6"]:
    """dL by the camera's small motion q' = exp([w]x) q + tau from dL by the matrix V of q = V (p, 1).

    A column v of V moves by w x v, the last one by tau too: dL/dw = sum over columns of v x dL/dv.
    """
    v, g = (m[:3].double() for m in (view, by_view))
    return torch.cat([torch.linalg.cross(v.T, g.T).sum(0), g[:, 3]])


def pairs(meta: dict, width: int, height: int) -> tuple[Int[Tensor, "m"], Int[Tensor, "m"], Float32[Tensor, "m"]]:
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


def loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None = None,
    structure: float = 0.2,
    threads: int | None = None,
) -> tuple[float, Float32[Array, "h w c"]]:
    """See `cpu.loss`; on the GPU in float64, by autograd."""
    return loss_on(torch.device("cuda"), image, target, weight, structure)
