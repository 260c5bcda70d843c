"""The rasterizer on an NVIDIA GPU, by gsplat (the extra `cuda`; written for version 1.5).

Tests run on a GPU where there is one, and elsewhere with a stand-in for gsplat. gsplat shares this library's
conventions (pixel centres at half integers, covariance plus dilation, 1/255, 1e-4, the rim at which the projection is
linearised, harmonics), but for:
- alpha is clamped at .999, not .99: a weight may differ by .009 where opacities exceed .99, else by float32 roundings.
- covariances are inverted by differences of large numbers in float32: of splats a thousand times as long as wide many
  are drawn wrong or not at all (fits allow a factor of 10); standard deviations beyond 1e18 pixels or units are lost.
- sums are atomic: two runs differ in the last bits.
Each call of the interface copies arrays to the GPU and back (`forward_each` copies Gaussians once), and `adam` runs on
the CPU. A fit keeps its arrays on the GPU (`reconstruction.fitting.device_descent`): it calls `draw`, `differentiate`
and `project_back`, which neither copy nor read. gsplat itself reads one number a picture, the length of its list of
tiles.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import gsplat  # pyright: ignore[reportMissingImports]  an extra
import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Float64, Int
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.arrays import on_host
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import interface
from dav_gswt.raster import torch as plain
from dav_gswt.raster.interface import Contributions, Forward, GaussianArrays, Gradients, PictureGradients, Rendering
from dav_gswt.raster.torch import join_gradients, step_adam

__all__ = ["Rasterizer", "compute_loss", "step_adam"]

ALPHA_MAX = 0.999  # gsplat's
ANY_DEPTH = 1e-37, 3e38  # near and far plane that keep all before the camera: the limits of float32


@dataclass(frozen=True)
class DeviceCamera:
    """A camera's numbers on a device, for Gaussians relative to its centre."""

    width: int
    height: int
    orthographic: bool
    centre: Float64[Tensor, "3"]
    view: Float32[Tensor, "4 4"]
    inner: Float32[Tensor, "3 3"]


def upload_camera(camera: Camera, device: torch.device) -> DeviceCamera:
    """The camera on a device."""
    view = torch.eye(4)
    view[:3, :3] = torch.as_tensor(np.asarray(camera.rotation))
    inner = [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
    numbers = torch.as_tensor(np.asarray(camera.centre, float)), view, torch.tensor(inner, dtype=torch.float32)
    return DeviceCamera(camera.width, camera.height, camera.orthographic, *(t.to(device) for t in numbers))


@dataclass(frozen=True)
class GsplatForward:
    """A forward pass of gsplat: its autograd graph and intermediate results."""

    leaves: dict[str, Tensor]
    picture: Float32[Tensor, "1 h w c"]
    alpha: Float32[Tensor, "1 h w 1"]
    meta: dict[str, Any]


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`. device: where gsplat runs. threads: not used."""

    def __init__(self, device: str = "cuda", **options: Any):
        super().__init__(**options)
        self.device = torch.device(device)
        self._loaded: tuple[GaussianArrays | None, dict[str, Tensor]] = (None, {})

    def draw(self, given: dict[str, Tensor], camera: DeviceCamera) -> GsplatForward:
        """The forward pass of Gaussians on the device; given: `GaussianArrays` by name, world coordinates."""
        given = given | {"means": (given["means"].double() - camera.centre).float()}  # R m + t cancels far out
        with torch.enable_grad():
            leaves = {name: tensor.detach().requires_grad_() for name, tensor in given.items()}
            picture, alpha, meta = self._call_gsplat(leaves, camera)
        return GsplatForward(leaves, picture, alpha, meta)

    def differentiate(
        self, last: GsplatForward, by_picture: Float[Tensor, "h w c"], by_alpha: Float[Tensor, "h w"]
    ) -> dict[str, Tensor]:
        """Gradients by the parameters, by name, from the gradients by gsplat's picture and alpha.

        by_picture: of the picture's first channels; of the others they are zero.
        """
        missing = last.picture.shape[-1] - by_picture.shape[-1]
        found = torch.autograd.grad(
            (last.picture, last.alpha),
            tuple(last.leaves.values()),
            (torch.nn.functional.pad(by_picture, (0, missing))[None], by_alpha[None, ..., None]),
            retain_graph=True,
            materialize_grads=True,
        )
        return dict(zip(last.leaves, found, strict=True))

    def project_back(self, last: GsplatForward, values: Float32[Tensor, "h w"]) -> Float32[Tensor, "n"]:
        """Values of pixels summed by blend weights: they are the gradient by a channel, the depth, of such a loss."""
        by_picture = torch.nn.functional.pad(values[..., None], (last.picture.shape[-1] - 1, 0))[None]
        return torch.autograd.grad(last.picture, last.meta["depths"], by_picture, retain_graph=True)[0][0]

    def contribute(
        self, last: GsplatForward, maps: Float32[Tensor, "h w c"]
    ) -> tuple[Float32[Tensor, "n"], Float32[Tensor, "n"], Float32[Tensor, "n c"]]:
        """The tensors of `Contributions`."""
        h, w = maps.shape[:2]
        with torch.no_grad():
            gaussians, pixels, blend = list_pairs(last.meta, w, h)
            by_pixel = maps.reshape(h * w, -1)
            zero = torch.zeros(len(last.leaves["means"]), device=self.device)
            total = zero.index_add(0, gaussians, blend)
            maximum = zero.scatter_reduce(0, gaussians, blend, "amax")
            mapped = [zero.index_add(0, gaussians, blend * m[pixels]) for m in by_pixel.T]
        return total, maximum, torch.stack(mapped, 1) if mapped else zero[:, None][:, :0]

    def _render(self, gaussians: GaussianArrays, camera: Camera) -> tuple[Rendering, Any]:
        if self._loaded[0] is not gaussians:
            self._loaded = gaussians, self._load(gaussians)
        last = self.draw(self._loaded[1], upload_camera(camera, self.device))
        picture = last.picture.detach()[0]
        images = picture[..., :-1], last.alpha.detach()[0, ..., 0], picture[..., -1]
        return Rendering(*(on_host(image) for image in images)), last

    def _load(self, gaussians: GaussianArrays) -> dict[str, Tensor]:
        """Gaussians on the device. Raises: ValueError: see `GaussianArrays.check_values`."""
        given = {name: torch.tensor(array, device=self.device) for name, array in vars(gaussians).items()}
        if not all(bool(tensor.isfinite().all()) for tensor in given.values()) or (
            len(gaussians.means) and bool((given["quats"].abs().amax(1) < interface.TINY).any())
        ):
            gaussians.check_values()
        return given

    def _differentiate(self, last: Forward, given: PictureGradients) -> Gradients:
        by_channel = join_gradients(last.rendering, given).to(self.device)
        by_picture = torch.cat([by_channel[..., :-2], by_channel[..., -1:]], 2)
        found = self.differentiate(last.state, by_picture, by_channel[..., -2])
        return Gradients(**{name: on_host(gradient) for name, gradient in found.items()})

    def _contribute(self, last: Forward, weights: Float32[Array, "h w c"]) -> Contributions:
        maps = torch.tensor(weights, device=self.device)
        return Contributions(*(on_host(t) for t in self.contribute(last.state, maps)))

    def _visible(self, last: Forward) -> Bool[Array, "n"]:
        return on_host(find_visible(last.state))

    def _call_gsplat(self, leaves: dict[str, Tensor], camera: DeviceCamera):
        """gsplat's picture (colours, depth), alpha and intermediate results.

        It is given colours, not harmonics: for these it would invert the view, for which the host waits.
        """
        means, quats, colours = leaves["means"], leaves["quats"], leaves["colours"]
        if colours.ndim == 3:
            towards = camera.view[2, :3].expand(len(means), 3) if camera.orthographic else means
            degree, there = int(colours.shape[1] ** 0.5) - 1, (towards.detach() != 0).any(1)
            colours = (gsplat.spherical_harmonics(degree, towards, colours, masks=there) + 0.5).clamp(min=0)
        near, far = ANY_DEPTH
        return gsplat.rasterization(
            means,
            quats / quats.detach().abs().amax(1, keepdim=True),  # gsplat squares them: 1e30 would be too much
            leaves["log_scales"].exp(),
            torch.sigmoid(leaves["opacity_logits"]),
            colours,
            camera.view[None],
            camera.inner[None],
            camera.width,
            camera.height,
            near_plane=near if camera.orthographic else self.near,
            far_plane=far,
            eps2d=self.dilation,
            packed=False,
            render_mode="RGB+D",
            rasterize_mode="antialiased" if self.antialiased else "classic",
            camera_model="ortho" if camera.orthographic else "pinhole",
        )


def find_visible(last: GsplatForward) -> Bool[Tensor, "n"]:
    """Which Gaussians may have a pixel."""
    return (last.meta["radii"][0] > 0).all(-1)


def list_pairs(
    meta: dict[str, Any], width: int, height: int
) -> tuple[Int[Tensor, "m"], Int[Tensor, "m"], Float32[Tensor, "m"]]:
    """Every Gaussian that a pixel blends, pixel after pixel from front to back: Gaussian, pixel, blend weight.

    The weight is alpha times the product of 1 - alpha over those before it in the same pixel, as the difference of two
    entries of one running sum of logarithms (float64: it runs over the whole picture).
    """
    means, conics, opacities = (meta[name] for name in ("means2d", "conics", "opacities"))
    clear = torch.ones(1, height, width, device=means.device)
    gaussians, pixels = gsplat.rasterize_to_indices_in_range(
        0, 1 << 30, clear, means, conics, opacities, width, height,
        meta["tile_size"], meta["isect_offsets"], meta["flatten_ids"],
    )[:2]  # fmt: skip
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


compute_loss = partial(plain.compute_loss, device="cuda", dtype=torch.float32)
