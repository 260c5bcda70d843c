"""The rasterizer's C++ core as functions of NumPy arrays: float32, C-contiguous, never copied.

Results have the same bits for any number of threads. They differ in the last bits between instruction sets
(`instruction_set`). The environment variable DAV_GSWT_ISA fixes that, DAV_GSWT_THREADS the number of threads.
"""

import os
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.raster.waiting import patiently

with patiently():
    from dav_gswt.raster import _core

TINY = 1 << 15  # Gaussians plus pixels below which a second thread costs more than it brings
MOST_THREADS = 16


@dataclass(frozen=True)
class Rendering:
    """Sums over the splats of a pixel by blend weight w: of colours, of w itself, of depths. Read-only."""

    colour: Float32[Array, "h w c"]
    alpha: Float32[Array, "h w"]
    depth: Float32[Array, "h w"]


@dataclass(frozen=True)
class Gradients:
    """dL by each parameter; 0 for Gaussians that are not seen."""

    means: Float32[Array, "n 3"]
    log_scales: Float32[Array, "n 3"]
    quats: Float32[Array, "n 4"]
    opacity_logits: Float32[Array, "n"]
    colours: Float32[Array, "n c"]


@dataclass(frozen=True)
class Contributions:
    """What each Gaussian gives to a picture: the sum and the maximum over pixels of its blend weight w, and, of a map
    m given for the pixels, the sum of w m."""

    total: Float32[Array, "n"]
    maximum: Float32[Array, "n"]
    mapped: Float32[Array, "n c"]


def instruction_sets() -> list[str]:
    """Names of the instruction sets that this processor has and the core was built for, best first."""
    return _core.instruction_sets()


def instruction_set() -> str:
    """The instruction set in use: the best, or DAV_GSWT_ISA. Raises: ValueError: that one is not there."""
    names = instruction_sets()
    name = os.environ.get("DAV_GSWT_ISA") or names[0]
    if name not in names:
        raise ValueError(f"DAV_GSWT_ISA={name}: this processor has {', '.join(names)}; choose one of them")
    return name


def default_threads() -> int:
    """DAV_GSWT_THREADS, or the processors that this process may use, at most 16."""
    if given := os.environ.get("DAV_GSWT_THREADS"):
        if not given.isdecimal() or int(given) < 1:
            raise ValueError(f"DAV_GSWT_THREADS={given}: give a whole number from 1")
        return int(given)
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(mine, MOST_THREADS)


class Rasterizer:
    """Draws Gaussians and takes gradients back; its memory is kept from call to call. For one thread of Python at a
    time: give each its own.

    near: a pinhole camera leaves out Gaussians whose centre is nearer, in units of the world (an orthographic camera
    those with depth <= 0). dilation: variance added to every splat, in square pixels: no splat falls between pixels.
    threads, instruction_set: see `default_threads`, `instruction_set`.

    Of a Gaussian with peak opacity o, alpha at a pixel is min(.99, o exp(-q/2)), 0 where below 1/255; splats are
    blended by depth of their centres, those of equal depth by index; a pixel takes no splat that would leave it less
    than 1e-4 transmittance.
    """

    def __init__(
        self, near: float = 0.01, dilation: float = 0.3, threads: int | None = None, instruction_set: str | None = None
    ):
        if not near > 0 or not 0 <= dilation < np.inf:
            raise ValueError(f"near must be positive and dilation not negative, not {near} and {dilation}")
        if threads is not None and threads < 1:
            raise ValueError(f"threads must be at least 1, not {threads}")
        self.near, self.dilation = near, dilation
        self.threads = threads or default_threads()
        self._core = _core.Context(instruction_set or globals()["instruction_set"]())
        self._last = None  # of forward: arrays, images, threads

    def forward(
        self,
        means: Float32[Array, "n 3"],
        log_scales: Float32[Array, "n 3"],
        quats: Float32[Array, "n 4"],
        opacity_logits: Float32[Array, "n"],
        colours: Float32[Array, "n c"],
        camera: Camera,
    ) -> Rendering:
        """Draw Gaussians over black: log_scales are natural logarithms, quats w x y z of any length.

        Raises: ValueError: an array's type, shape or layout, a value that is not finite, a zero quaternion (index).
        """
        n, c = _rows(means), _columns(colours)
        arrays = {"means": means, "log_scales": log_scales, "quats": quats}
        arrays |= {"opacity_logits": opacity_logits, "colours": colours}
        for (name, array), shape in zip(arrays.items(), [(n, 3), (n, 3), (n, 4), (n,), (n, c)], strict=True):
            _check(array, name, shape)
        h, w = _size(camera)
        images = np.empty((h, w, c), np.float32), np.empty((h, w), np.float32), np.empty((h, w), np.float32)
        threads = 1 if n + h * w < TINY else self.threads
        self._last = None
        view = _numbers(camera, self.near, self.dilation), w, h, bool(camera.orthographic)
        if not self._core.forward(*arrays.values(), *view, *images, threads):
            _find_invalid(arrays)
        for image in images:  # backward needs them as they are
            image.flags.writeable = False
        self._last = tuple(arrays.values()), images, threads
        return Rendering(*images)

    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
    ) -> Gradients:
        """Gradients of a loss at the last forward, from its gradients by the three images (None: zero).

        The arrays given to forward must not have changed since. By alpha's clamp at .99, the gradient through a
        clamped alpha is 0. Raises: ValueError: no forward yet, or an array's type, shape or layout.
        """
        arrays, images, threads = self._forwarded()
        for name, value, image in zip(
            ("colour", "alpha", "depth"), (grad_colour, grad_alpha, grad_depth), images, strict=True
        ):
            if value is not None:
                _check(value, f"grad_{name}", image.shape)
        out = [np.empty(a.shape, np.float32) for a in arrays]
        self._core.backward(*arrays, *images, grad_colour, grad_alpha, grad_depth, *out, threads)
        return Gradients(*out)

    def contributions(self, weights: Float32[Array, "h w c"] | None = None) -> Contributions:
        """Blend weights of the last forward, and the map `weights` carried back onto the Gaussians by them."""
        arrays, images, threads = self._forwarded()
        n, (h, w) = len(arrays[0]), images[1].shape
        if weights is None:
            weights = np.empty((h, w, 0), np.float32)
        _check(weights, "weights", (h, w, _columns(weights)))
        out = np.empty(n, np.float32), np.empty(n, np.float32), np.empty((n, weights.shape[2]), np.float32)
        self._core.contributions(weights, *out, threads)
        return Contributions(*out)

    def _forwarded(self):
        if self._last is None:
            raise ValueError("nothing was drawn yet: call forward first")
        return self._last


def loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None = None,
    structure: float = 0.2,
    threads: int | None = None,
) -> tuple[float, Float32[Array, "h w c"]]:
    """(1 - structure) L1 + structure (1 - SSIM), and its gradient by the image.

    With weights w in [0, 1] (None: 1) over N = h w c values,
    loss = 1/N sum of w [(1 - structure) |x - y| + structure (1 - SSIM)].
    SSIM's local means, variances and covariance are those of the pixels that count: averages by an 11-tap Gaussian
    (sigma 1.5) times w, divided by that window's sum of both; so neither pixels of weight 0 nor those beyond the
    border have any influence, and a uniform weight w scales loss and gradient. Constants as usual for values in [0, 1]:
    C1 = .01^2, C2 = .03^2. Raises: ValueError: an array's type, shape or layout.
    """
    _check(image, "image", (*image.shape[:2], _columns(image)))
    _check(target, "target", image.shape)
    if weight is not None:
        _check(weight, "weight", image.shape[:2])
    gradient = np.empty(image.shape, np.float32)
    threads = 1 if image.size < TINY else threads or default_threads()
    return _core.loss(instruction_set(), image, target, weight, structure, gradient, threads), gradient


def adam(
    values: Float32[Array, "n ..."],
    gradient: Float32[Array, "n ..."],
    first: Float32[Array, "n ..."],
    second: Float32[Array, "n ..."],
    rate: float,
    step: int,
    betas: tuple[float, float] = (0.9, 0.999),
    epsilon: float = 1e-15,
    rows: Bool[Array, "n"] | None = None,
    threads: int | None = None,
) -> None:
    """One step of Adam, in place: values, and the moments `first` and `second`, which start as zeros.

    values -= rate m / (sqrt(v) + epsilon) with m = first / (1 - beta1^step), v = second / (1 - beta2^step).
    step: counts from 1. rows: only these move; the moments of the others stay.
    Raises: ValueError: an array's type, shape or layout, or a step below 1.
    """
    if step < 1:
        raise ValueError(f"step counts from 1, not {step}")
    for name, array in (("values", values), ("gradient", gradient), ("first", first), ("second", second)):
        _check(array, name, values.shape)
        if array is not gradient and not array.flags.writeable:
            raise ValueError(f"{name} is read-only, but is to be changed in place")
    if rows is not None:
        _check(rows, "rows", values.shape[:1], np.bool_)
    threads = 1 if values.size < TINY else threads or default_threads()
    _core.adam(instruction_set(), values, gradient, first, second, rows, step, rate, *betas, epsilon, threads)


def _check(array, name: str, shape: tuple[int, ...], dtype=np.float32) -> None:
    if not isinstance(array, np.ndarray) or array.dtype != dtype:
        kind = getattr(array, "dtype", type(array).__name__)
        raise ValueError(f"{name} must be an array of {np.dtype(dtype).name}, not {kind}")
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, not {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name} must be C-contiguous: use numpy.ascontiguousarray")


def _rows(means) -> int:
    return len(means) if np.ndim(means) else 0


def _columns(array) -> int:
    """Values in the last axis, where there is one."""
    return np.shape(array)[-1] if np.ndim(array) else 0


def _size(camera: Camera) -> tuple[int, int]:
    if not (0 < camera.width < 1 << 15 and 0 < camera.height < 1 << 15):
        raise ValueError(f"a picture has 1 to 32767 pixels a side, not {camera.width} x {camera.height}")
    return camera.height, camera.width


def _numbers(camera: Camera, near: float, dilation: float) -> Float32[Array, "18"]:
    inner = [camera.fx, camera.fy, camera.cx, camera.cy, near, dilation]
    values = np.concatenate([np.ravel(camera.rotation), np.ravel(camera.translation), inner]).astype(np.float32)
    if values.shape != (18,) or not np.isfinite(values).all():
        raise ValueError("a camera needs a 3 x 3 rotation and a translation of 3, all finite")
    if not (camera.fx > 0 and camera.fy > 0):
        raise ValueError(f"a camera's focal lengths must be positive, not {camera.fx} and {camera.fy}")
    return values


def _find_invalid(arrays: dict[str, Array]) -> None:
    for name, array in arrays.items():
        bad = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(1))
        if len(bad):
            raise ValueError(f"{name} of Gaussian {bad[0]} is not finite ({len(bad)} such)")
    zero = np.flatnonzero(np.abs(arrays["quats"]).max(1) < 1e-36)
    raise ValueError(f"the quaternion of Gaussian {zero[0] if len(zero) else '?'} is zero")
