"""The rasterizer's C++ core as functions of NumPy arrays: float32, C-contiguous, never copied.

Results have the same bits for any number of threads. They differ in the last bits between instruction sets
(`instruction_set`). The environment variable DAV_GSWT_ISA fixes that, DAV_GSWT_THREADS the number of threads.
"""

import os
import weakref

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import _core, interface
from dav_gswt.raster.interface import Contributions, Gradients, Rendering

TINY = 1 << 15  # Gaussians plus pixels below which a second thread costs more than it brings
MOST_THREADS = 16
NAMES = ("means", "log_scales", "quats", "opacity_logits", "colours", "features")


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


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`. Its memory is kept from call to call, and that of gradients is used again once nobody
    holds them any more.

    What a Gaussian costs that cannot have a pixel is a look at its mean and its scales: whether its other values are
    finite is not looked at. threads, instruction_set: see `default_threads`, `instruction_set`.
    """

    def __init__(
        self,
        near: float = 0.01,
        dilation: float = 0.3,
        antialiased: bool = False,
        threads: int | None = None,
        instruction_set: str | None = None,
    ):
        super().__init__(near, dilation, antialiased, threads)
        self.threads = threads or default_threads()
        self._core = _core.Context(instruction_set or globals()["instruction_set"]())
        self._memory = _Memory()

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
        interface.check_shapes(arrays)
        size = camera.height, camera.width
        channels = [colours.shape[-1:], (), ()] + ([] if features is None else [features.shape[1:]])
        images = [np.empty((*size, *c), np.float32) for c in channels] + [None] * (features is None)
        threads = 1 if len(means) + size[0] * size[1] < TINY else self.threads
        self._last = None
        view = _numbers(camera, self.near, self.dilation), *size[::-1], bool(camera.orthographic), self.antialiased
        if not self._core.forward(*arrays.values(), *view, *images, threads):
            interface.find_invalid({name: array for name, array in arrays.items() if array is not None})
        for image in images[: len(channels)]:  # backward needs them as they are
            image.flags.writeable = False
        self._last = arrays, images, threads
        return Rendering(*images)

    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
        grad_features: Float32[Array, "h w f"] | None = None,
    ) -> Gradients:
        arrays, images, threads = self._forwarded()
        given = (grad_colour, grad_alpha, grad_depth, grad_features)
        if grad_features is not None and images[3] is None:
            raise ValueError("grad_features is given, but forward was given no features")
        for name, value, image in zip(("colour", "alpha", "depth", "features"), given, images, strict=True):
            if value is not None:
                interface.check(value, f"grad_{name}", image.shape)
        out = {name: None if a is None else self._memory.of(name, a.shape) for name, a in arrays.items()}
        out["camera"] = np.empty(6, np.float32)
        self._core.backward(*arrays.values(), *images, *given, *out.values(), threads)
        return Gradients(**out)

    def contributions(self, weights: Float32[Array, "h w c"] | None = None) -> Contributions:
        arrays, images, threads = self._forwarded()
        n, size = len(arrays["means"]), images[1].shape
        weights = np.empty((*size, 0), np.float32) if weights is None else weights
        interface.check(weights, "weights", (*size, interface.columns(weights)))
        out = [np.empty(n, np.float32) for _ in range(3)] + [np.empty((n, weights.shape[2]), np.float32)]
        self._core.contributions(weights, *out, threads)
        return Contributions(*out)

    @property
    def visible(self) -> Bool[Array, "n"]:
        found = np.empty(len(self._forwarded()[0]["means"]), bool)
        self._core.drawn(found)
        return found

    def pairs(self) -> int:
        """Of the last forward: how many pixels take a splat (alpha at least 1/255, not used up), summed over splats."""
        return int(self._core.pairs(self._forwarded()[2]))


class _Memory:
    """Arrays whose memory is used again when nobody holds them, nor a view of them: fresh memory costs a page fault
    every 4 kB, more than what is written to it."""

    def __init__(self):
        self._kept = {}  # by name: memory, and a weak reference to the array that all views of it hold on to

    def of(self, name: str, shape: tuple[int, ...]) -> Float32[Array, "..."]:
        """An array of this shape; its values mean nothing."""
        size = int(np.prod(shape))
        if not size:
            return np.empty(shape, np.float32)
        memory, last = self._kept.get(name, (None, None))
        if memory is None or len(memory) != size or last() is not None:
            memory = memoryview(np.empty(size, np.float32))
        root = np.frombuffer(memory, np.float32)  # its base is no array: views of it hold `root` itself
        self._kept[name] = memory, weakref.ref(root)
        return root.reshape(shape)


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
    interface.check(image, "image", (*image.shape[:2], interface.columns(image)))
    interface.check(target, "target", image.shape)
    if weight is not None:
        interface.check(weight, "weight", image.shape[:2])
    gradient = np.empty(image.shape, np.float32)
    threads = 1 if image.size < TINY else threads or default_threads()
    return _core.loss(instruction_set(), image, target, weight, structure, gradient, threads), gradient


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
    """One step of Adam, in place: values, and the moments `first` and `second`, which start as zeros.

    values -= rate m / (sqrt(v) + epsilon) with m = first / (1 - beta1^step), v = second / (1 - beta2^step).
    rate: one for all, or one a column (values.size / n). step: counts from 1. rows: only these move; the moments of the
    others stay. Raises: ValueError: an array's type, shape or layout, or a step below 1.
    """
    if step < 1:
        raise ValueError(f"step counts from 1, not {step}")
    for name, array in (("values", values), ("gradient", gradient), ("first", first), ("second", second)):
        interface.check(array, name, values.shape)
        if array is not gradient and not array.flags.writeable:
            raise ValueError(f"{name} is read-only, but is to be changed in place")
    if rows is not None:
        interface.check(rows, "rows", values.shape[:1], np.bool_)
    rates, columns = np.asarray(rate, np.float32).reshape(-1), values.size // max(1, len(values))
    if len(rates) not in (1, columns):
        raise ValueError(f"rate must be one number or {columns}, one a column, not {len(rates)}")
    threads = 1 if values.size < TINY else threads or default_threads()
    _core.adam(instruction_set(), values, gradient, first, second, rows, step, rates, *betas, epsilon, threads)


def _numbers(camera: Camera, near: float, dilation: float) -> Float32[Array, "18"]:
    inner = [camera.fx, camera.fy, camera.cx, camera.cy, near, dilation]
    return np.concatenate([np.ravel(camera.rotation), np.ravel(camera.translation), inner]).astype(np.float32)
