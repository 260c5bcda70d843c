"""The interface of every rasterizer backend: its inputs, their checks, and its outputs.

A backend is a module with a `Rasterizer`, `compute_loss` and `step_adam`: `cpu` (the C++ core), `torch` (plain PyTorch,
for machines without the core) or `cuda` (gsplat). `backends` selects one. They agree within the tolerances in
tests/unit/raster/test_backends.py.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera

TINY = 1e-36  # a quaternion all of whose parts are smaller is zero
RIM = 3.33  # standard deviations at which an opaque Gaussian ends: exp(-RIM^2 / 2) = 1/255


@dataclass(frozen=True)
class GaussianArrays:
    """n Gaussians as `Rasterizer.forward` takes them, float32 and C-contiguous."""

    means: Float32[Array, "n 3"]
    log_scales: Float32[Array, "n 3"]
    quats: Float32[Array, "n 4"]
    opacity_logits: Float32[Array, "n"]
    colours: Float32[Array, "n c"] | Float32[Array, "n k 3"]

    def check_shapes(self) -> None:
        """Raises: ValueError: an array's type, shape or layout; values are not checked."""
        n = len(self.means) if np.ndim(self.means) else 0
        for name, shape in {"means": (n, 3), "log_scales": (n, 3), "quats": (n, 4), "opacity_logits": (n,)}.items():
            check(getattr(self, name), name, shape)
        harmonics = self.colours.shape[1] if np.ndim(self.colours) == 3 else None
        if harmonics not in (None, 1, 4, 9, 16):
            raise ValueError(f"colours has {harmonics} coefficients; 1, 4, 9 or 16 make whole degrees")
        check(self.colours, "colours", (n, harmonics, 3) if harmonics else (n, count_columns(self.colours)))

    def check_values(self) -> None:
        """Raises: ValueError: a value that is not finite, or a zero quaternion, with the Gaussian's index."""
        for name, array in vars(self).items():
            if not np.isfinite(array).all():
                bad = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(1))
                raise ValueError(f"{name} of Gaussian {bad[0]} is not finite ({len(bad)} such)")
        zero = np.flatnonzero(np.abs(self.quats).max(1, initial=0) < TINY)
        if len(zero):
            raise ValueError(f"the quaternion of Gaussian {zero[0]} is zero")


def to_raster_arrays(
    field: GaussianField, colours: Float32[Array, "n c"] | None = None
) -> dict[str, Float[Array, "..."]]:
    """Keyword arguments of `Rasterizer.forward`. colours: channels to draw instead of the spherical harmonics."""
    arrays = {name: getattr(field, name) for name in ("means", "log_scales", "quats", "opacity_logits")}
    return arrays | {"colours": np.ascontiguousarray(field.sh if colours is None else colours, np.float32)}


@dataclass(frozen=True)
class Rendering:
    """Per pixel the sums over its splats, weighted by blend weight w, of colours, 1 and depths. Read-only."""

    colour: Float32[Array, "h w c"]
    alpha: Float32[Array, "h w"]
    depth: Float32[Array, "h w"]


class Gradients(GaussianArrays):
    """Gradient of a loss by each parameter; 0 for invisible Gaussians."""


@dataclass(frozen=True)
class Contributions:
    """Per Gaussian, over the pixels of a picture: sum of its blend weight w, maximum of w, sum of w m for a map m."""

    total: Float32[Array, "n"]
    maximum: Float32[Array, "n"]
    mapped: Float32[Array, "n c"]


@dataclass(frozen=True)
class Forward:
    """The last forward pass. state: what the backend keeps for its backward pass."""

    gaussians: GaussianArrays
    camera: Camera
    rendering: Rendering
    state: Any


PictureGradients = dict[str, Array | None]  # of a loss by colour, alpha and depth, in this order; None: zero


class Rasterizer(ABC):
    """Renders Gaussians and differentiates the rendering. `make_rasterizer` makes one.

    For one Python thread at a time: give each its own.

    near: a pinhole camera leaves out Gaussians whose centre is nearer, in world units (an orthographic camera those
    with depth <= 0). dilation: variance added to every splat, in square pixels, so that no splat falls between pixels.
    antialiased: opacity is multiplied by sqrt(det S0 / det S), S0 the splat's covariance without and S with the
    dilation, so that splats below a pixel's size fade instead of growing. threads: where the backend uses them.

    With peak opacity o, alpha at a pixel is min(.99, o exp(-q/2)), 0 where below 1/255. Splats are blended in the order
    of their centres' depths, equal depths in the order of indices. A pixel takes no splat that would leave it less than
    1e-4 transmittance.
    Raises: ValueError: near is not positive, dilation is negative, or threads is below 1.
    """

    def __init__(
        self, near: float = 0.01, dilation: float = 0.3, antialiased: bool = False, threads: int | None = None
    ):
        if not near > 0 or not 0 <= dilation < np.inf:
            raise ValueError(f"near must be positive and dilation not negative, not {near} and {dilation}")
        if threads is not None and threads < 1:
            raise ValueError(f"threads must be at least 1, not {threads}")
        self.near, self.dilation, self.antialiased, self.threads = near, dilation, antialiased, threads
        self._last: Forward | None = None

    def forward(
        self,
        means: Float32[Array, "n 3"],
        log_scales: Float32[Array, "n 3"],
        quats: Float32[Array, "n 4"],
        opacity_logits: Float32[Array, "n"],
        colours: Float32[Array, "n c"] | Float32[Array, "n k 3"],
        camera: Camera,
    ) -> Rendering:
        """Render Gaussians over black. log_scales: natural logarithms. quats: w x y z, of any length but 0.

        colours: channels, or spherical harmonics (k = 1, 4, 9, 16; see `harmonics`) seen from the camera.
        Raises: ValueError: an array's type, shape or layout, a value that is not finite, a zero quaternion (index).
        """
        return self._forward(GaussianArrays(means, log_scales, quats, opacity_logits, colours), camera)

    def forward_each(self, arrays: Mapping[str, Array], cameras: Iterable[Camera]) -> Iterator[Rendering]:
        """`forward` of the same Gaussians for one camera after the other; they must not change in between.

        A GPU is given them once, not for each picture.
        """
        gaussians = GaussianArrays(**arrays)
        return (self._forward(gaussians, camera) for camera in cameras)

    def _forward(self, gaussians: GaussianArrays, camera: Camera) -> Rendering:
        check_camera(camera)
        gaussians.check_shapes()
        self._last = None
        rendering, state = self._render(gaussians, camera)
        for image in vars(rendering).values():
            image.flags.writeable = False  # the backward pass reads them
        self._last = Forward(gaussians, camera, rendering, state)
        return rendering

    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
    ) -> Gradients:
        """Gradients of a loss at the last forward pass, from its gradients by the images (None: zero).

        The arrays given to forward must not have changed. The gradient through an alpha clamped at .99 is 0.
        Raises: ValueError: no forward pass yet, or an array's type, shape or layout.
        """
        last = self._require_forward()
        given: PictureGradients = {"colour": grad_colour, "alpha": grad_alpha, "depth": grad_depth}
        for name, array in given.items():
            if array is not None:
                check(array, f"grad_{name}", getattr(last.rendering, name).shape)
        return self._differentiate(last, given)

    def contributions(self, weights: Float32[Array, "h w c"] | None = None) -> Contributions:
        """Blend weights of the last forward pass, and sums of the map `weights` by them."""
        last = self._require_forward()
        size = last.camera.height, last.camera.width
        weights = np.empty((*size, 0), np.float32) if weights is None else weights
        check(weights, "weights", (*size, count_columns(weights)))
        return self._contribute(last, weights)

    @property
    def visible(self) -> Bool[Array, "n"]:
        """Which Gaussians of the last forward pass may have a pixel; the gradients of all others are 0."""
        return self._visible(self._require_forward())

    @abstractmethod
    def _render(self, gaussians: GaussianArrays, camera: Camera) -> tuple[Rendering, Any]:
        """The images, and the state that `Forward` keeps. Raises: ValueError: see `GaussianArrays.check_values`."""

    @abstractmethod
    def _differentiate(self, last: Forward, given: PictureGradients) -> Gradients: ...

    @abstractmethod
    def _contribute(self, last: Forward, weights: Float32[Array, "h w c"]) -> Contributions: ...

    @abstractmethod
    def _visible(self, last: Forward) -> Bool[Array, "n"]: ...

    def _require_forward(self) -> Forward:
        if self._last is None:
            raise ValueError("nothing was rendered yet: call forward first")
        return self._last


@dataclass(frozen=True)
class AdamStep:
    """The checked inputs of `backends.adam`, arrays, or tensors of columns. rates: one, or one a column. rows: of
    tensors 1 for those that move and 0 for those that stay."""

    values: Float32[Any, "n ..."]
    gradient: Float32[Any, "n ..."]
    first: Float32[Any, "n ..."]
    second: Float32[Any, "n ..."]
    rates: float | Float32[Any, "columns"]
    step: int
    betas: tuple[float, float]
    epsilon: float
    rows: Bool[Array, "n"] | Float32[Any, "n 1"] | None
    threads: int | None = None


def check(array, name: str, shape: tuple[int, ...], dtype: type[np.generic] = np.float32) -> None:
    """Raises: ValueError: not an array of this type and shape, or one that is not C-contiguous."""
    if not isinstance(array, np.ndarray) or array.dtype != dtype:
        kind = getattr(array, "dtype", type(array).__name__)
        raise ValueError(f"{name} must be an array of {np.dtype(dtype).name}, not {kind}")
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, not {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name} must be C-contiguous: use numpy.ascontiguousarray")


def count_columns(array) -> int:
    """Length of the last axis; 0 without one."""
    return np.shape(array)[-1] if np.ndim(array) else 0


def check_camera(camera: Camera) -> None:
    """Raises: ValueError: a size, a focal length or another number of the camera is impossible."""
    if not (0 < camera.width < 1 << 15 and 0 < camera.height < 1 << 15):
        raise ValueError(f"a picture has 1 to 32767 pixels a side, not {camera.width} x {camera.height}")
    inner = [camera.fx, camera.fy, camera.cx, camera.cy]
    values = np.concatenate([np.ravel(camera.rotation), np.ravel(camera.translation), inner]).astype(np.float32)
    if values.shape != (16,) or not np.isfinite(values).all():
        raise ValueError("a camera needs a 3 x 3 rotation and a translation of 3, all finite")
    if not (camera.fx > 0 and camera.fy > 0):
        raise ValueError(f"a camera's focal lengths must be positive, not {camera.fx} and {camera.fy}")
