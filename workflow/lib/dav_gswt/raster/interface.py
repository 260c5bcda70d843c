"""The interface of every rasterizer backend: its inputs, their checks, and its outputs.

A backend is a module that fits `Backend`: `cpu` (the C++ core), `torch` (plain PyTorch, for machines without the core)
or `cuda` (gsplat). `backends` selects one. They agree within the tolerances in tests/unit/raster/test_backends.py.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

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
    features: Float32[Array, "n f"] | None = None

    def by_name(self) -> dict[str, Array]:
        """The arrays that are present."""
        return {name: array for name, array in vars(self).items() if array is not None}


@dataclass(frozen=True)
class Rendering:
    """Per pixel the sums over its splats, weighted by blend weight w, of colours, 1, depths and features (None without
    features). Read-only."""

    colour: Float32[Array, "h w c"]
    alpha: Float32[Array, "h w"]
    depth: Float32[Array, "h w"]
    features: Float32[Array, "h w f"] | None = None


@dataclass(frozen=True)
class Gradients:
    """Gradient of a loss L by each parameter; 0 for invisible Gaussians.

    camera: by a small motion (w, tau) of the camera, q' = exp([w]x) q + tau, at no motion; w in radians.
    """

    means: Float32[Array, "n 3"]
    log_scales: Float32[Array, "n 3"]
    quats: Float32[Array, "n 4"]
    opacity_logits: Float32[Array, "n"]
    colours: Float32[Array, "n c"] | Float32[Array, "n k 3"]
    features: Float32[Array, "n f"] | None
    camera: Float32[Array, "6"]


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


@dataclass(frozen=True)
class PictureGradients:
    """Gradients of a loss by the images of a rendering; None: zero."""

    colour: Float32[Array, "h w c"]
    alpha: Float32[Array, "h w"] | None = None
    depth: Float32[Array, "h w"] | None = None
    features: Float32[Array, "h w f"] | None = None


class Rasterizer:
    """Renders Gaussians and differentiates the rendering. `Rasterizer(...)` is one of the backend in use.

    For one Python thread at a time: give each its own.

    near: a pinhole camera leaves out Gaussians whose centre is nearer, in world units (an orthographic camera those
    with depth <= 0). dilation: variance added to every splat, in square pixels, so that no splat falls between pixels.
    antialiased: opacity is multiplied by sqrt(det S0 / det S), S0 the splat's covariance without and S with the
    dilation, so that splats below a pixel's size fade instead of growing. threads: where the backend uses them.

    With peak opacity o, alpha at a pixel is min(.99, o exp(-q/2)), 0 where below 1/255. Splats are blended in the order
    of their centres' depths, equal depths in the order of indices. A pixel takes no splat that would leave it less than
    1e-4 transmittance.
    Raises: ValueError: near is not positive, dilation is negative, or threads is below 1.

    A backend implements `_render`, `_differentiate`, `_contribute` and `_visible`.
    """

    def __new__(cls, *_, **__):
        from dav_gswt.raster.backends import load_backend  # deferred: it imports this module

        kind: type = load_backend().Rasterizer if cls is Rasterizer else cls
        return object.__new__(kind)

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
        features: Float32[Array, "n f"] | None = None,
    ) -> Rendering:
        """Render Gaussians over black. log_scales: natural logarithms. quats: w x y z, of any length but 0.

        colours: channels, or spherical harmonics (k = 1, 4, 9, 16; see `harmonics`) seen from the camera.
        features: more channels, blended into an image of their own.
        Raises: ValueError: an array's type, shape or layout, a value that is not finite, a zero quaternion (index).
        """
        check_camera(camera)
        check_shapes(means, log_scales, quats, opacity_logits, colours, features)
        gaussians = GaussianArrays(means, log_scales, quats, opacity_logits, colours, features)
        self._last = None
        rendering, state = self._render(gaussians, camera)
        for image in vars(rendering).values():
            if image is not None:
                image.flags.writeable = False  # the backward pass reads them
        self._last = Forward(gaussians, camera, rendering, state)
        return rendering

    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
        grad_features: Float32[Array, "h w f"] | None = None,
    ) -> Gradients:
        """Gradients of a loss at the last forward pass, from its gradients by the images (None: zero).

        The arrays given to forward must not have changed. The gradient through an alpha clamped at .99 is 0.
        Raises: ValueError: no forward pass yet, or an array's type, shape or layout.
        """
        last = self._require_forward()
        given = {"colour": grad_colour, "alpha": grad_alpha, "depth": grad_depth, "features": grad_features}
        for name, array in given.items():
            image = getattr(last.rendering, name)
            if array is not None and image is None:
                raise ValueError(f"grad_{name} is given, but forward was given no {name}")
            if array is not None:
                check(array, f"grad_{name}", image.shape)
        return self._differentiate(last, PictureGradients(**given))

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

    def _render(self, gaussians: GaussianArrays, camera: Camera) -> tuple[Rendering, Any]:
        """The images, and the state that `Forward` keeps. Raises: ValueError: see `find_invalid`."""
        raise NotImplementedError

    def _differentiate(self, last: Forward, given: PictureGradients) -> Gradients:
        raise NotImplementedError

    def _contribute(self, last: Forward, weights: Float32[Array, "h w c"]) -> Contributions:
        raise NotImplementedError

    def _visible(self, last: Forward) -> Bool[Array, "n"]:
        raise NotImplementedError

    def _require_forward(self) -> Forward:
        if self._last is None:
            raise ValueError("nothing was rendered yet: call forward first")
        return self._last


class Loss:
    """(1 - structure) L1 + structure (1 - SSIM), and its gradient by the image.

    With weights w in [0, 1] (None: 1) over N = h w c values,
    loss = 1/N sum of w [(1 - structure) |x - y| + structure (1 - SSIM)].
    SSIM's local means, variances and covariance are weighted averages, by an 11-tap Gaussian (sigma 1.5) times w,
    divided by the window's sum of both: pixels of weight 0 and those beyond the border have no influence, and a uniform
    weight scales loss and gradient. C1 = .01^2, C2 = .03^2, as usual for values in [0, 1].
    Raises: ValueError: an array's type, shape or layout.

    compute: the backend's function of the checked image, target, weight, structure and threads.
    """

    def __init__(self, compute: Callable[..., tuple[float, Float32[Array, "h w c"]]]):
        self.compute = compute

    def __call__(
        self,
        image: Float32[Array, "h w c"],
        target: Float32[Array, "h w c"],
        weight: Float32[Array, "h w"] | None = None,
        structure: float = 0.2,
        threads: int | None = None,
    ) -> tuple[float, Float32[Array, "h w c"]]:
        check(image, "image", (*image.shape[:2], count_columns(image)))
        check(target, "target", image.shape)
        if weight is not None:
            check(weight, "weight", image.shape[:2])
        return self.compute(image, target, weight, structure, threads)


@dataclass(frozen=True)
class AdamStep:
    """The checked inputs of a step of `Adam`. rates: one, or one a column."""

    values: Float32[Array, "n ..."]
    gradient: Float32[Array, "n ..."]
    first: Float32[Array, "n ..."]
    second: Float32[Array, "n ..."]
    rates: Float32[Array, "columns"]
    step: int
    betas: tuple[float, float]
    epsilon: float
    rows: Bool[Array, "n"] | None
    threads: int | None


class Adam:
    """One step of Adam, in place: `values`, and the moments `first` and `second`, which start as zeros.

    values -= rate m / (sqrt(v) + epsilon) with m = first / (1 - beta1^step), v = second / (1 - beta2^step).
    rate: one for all, or one a column (values.size / n). step: counts from 1. rows: only these move; the moments of the
    others stay. Raises: ValueError: an array's type, shape or layout, or a step below 1.

    compute: the backend's function that does the step.
    """

    def __init__(self, compute: Callable[[AdamStep], None]):
        self.compute = compute

    def __call__(
        self,
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
        if step < 1:
            raise ValueError(f"step counts from 1, not {step}")
        for name, array in (("values", values), ("gradient", gradient), ("first", first), ("second", second)):
            check(array, name, values.shape)
            if array is not gradient and not array.flags.writeable:
                raise ValueError(f"{name} is read-only, but is to be changed in place")
        if rows is not None:
            check(rows, "rows", values.shape[:1], np.bool_)
        rates, columns = np.asarray(rate, np.float32).reshape(-1), values.size // max(1, len(values))
        if len(rates) not in (1, columns):
            raise ValueError(f"rate must be one number or {columns}, one a column, not {len(rates)}")
        self.compute(AdamStep(values, gradient, first, second, rates, step, betas, epsilon, rows, threads))


@runtime_checkable
class Backend(Protocol):
    """A module that renders: pyright checks each one against it in `backends`."""

    @property
    def Rasterizer(self) -> type[Rasterizer]: ...

    @property
    def loss(self) -> Loss: ...

    @property
    def adam(self) -> Adam: ...


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


def check_shapes(means, log_scales, quats, opacity_logits, colours, features) -> None:
    """Check the arrays that `forward` is given, but not their values.

    Raises: ValueError: an array's type, shape or layout.
    """
    n = len(means) if np.ndim(means) else 0
    check(means, "means", (n, 3))
    check(log_scales, "log_scales", (n, 3))
    check(quats, "quats", (n, 4))
    check(opacity_logits, "opacity_logits", (n,))
    if np.ndim(colours) == 3:
        if colours.shape[1] not in (1, 4, 9, 16):
            raise ValueError(f"colours has {colours.shape[1]} coefficients; 1, 4, 9 or 16 make whole degrees")
        check(colours, "colours", (n, colours.shape[1], 3))
    else:
        check(colours, "colours", (n, count_columns(colours)))
    if features is not None:
        check(features, "features", (n, count_columns(features)))


def find_invalid(gaussians: GaussianArrays) -> None:
    """Raises: ValueError: a value that is not finite, or a zero quaternion, with the Gaussian's index."""
    for name, array in gaussians.by_name().items():
        if not np.isfinite(array).all():
            bad = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(1))
            raise ValueError(f"{name} of Gaussian {bad[0]} is not finite ({len(bad)} such)")
    zero = np.flatnonzero(np.abs(gaussians.quats).max(1, initial=0) < TINY)
    if len(zero):
        raise ValueError(f"the quaternion of Gaussian {zero[0]} is zero")


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
