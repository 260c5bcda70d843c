"""What every backend takes and gives: pictures, gradients, contributions, and the checks of what comes in.

A backend is a module with `Rasterizer`, `loss` and `adam`: `cpu` (the C++ core), `torch` (plain PyTorch, for machines
without the core) or `cuda` (gsplat). `backends` says which one is in use. They agree within the tolerances that
tests/unit/raster/test_backends.py states.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import backends

RIM = 3.33  # standard deviations at which an opaque Gaussian ends: exp(-RIM^2 / 2) = 1/255


@dataclass(frozen=True)
class Rendering:
    """Sums over the splats of a pixel by blend weight w: of colours, of w itself, of depths, of features (None where
    none were given). Read-only."""

    colour: Float32[Array, "h w c"]
    alpha: Float32[Array, "h w"]
    depth: Float32[Array, "h w"]
    features: Float32[Array, "h w f"] | None = None


@dataclass(frozen=True)
class Gradients:
    """dL by each parameter; 0 for Gaussians that are not seen.

    camera: dL by a small motion of the camera, at none: its transform becomes q' = exp([w]x) q + tau, and the six
    numbers are (w, tau), w in radians.
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
    """What each Gaussian gives to a picture: the sum over pixels of its blend weight w, of w^2, the maximum of w, and,
    of a map m given for the pixels, the sum of w m."""

    total: Float32[Array, "n"]
    squared: Float32[Array, "n"]
    maximum: Float32[Array, "n"]
    mapped: Float32[Array, "n c"]


class Rasterizer:
    """Draws Gaussians and takes gradients back. `Rasterizer(...)` is one of the backend in use.

    For one thread of Python at a time: give each its own.

    near: a pinhole camera leaves out Gaussians whose centre is nearer, in units of the world (an orthographic camera
    those with depth <= 0). dilation: variance added to every splat, in square pixels: no splat falls between pixels.
    antialiased: opacity is multiplied by sqrt(det S0 / det S), S0 the splat's covariance without, S with the dilation,
    so that what is smaller than a pixel fades instead of growing. threads: where the backend has a use for it.

    Of a Gaussian with peak opacity o, alpha at a pixel is min(.99, o exp(-q/2)), 0 where below 1/255; splats are
    blended by depth of their centres, those of equal depth by index; a pixel takes no splat that would leave it less
    than 1e-4 transmittance.
    Raises: ValueError: near is not positive, dilation is negative, threads is below 1.
    """

    def __new__(cls, *_, **__):
        return super().__new__(backends.module().Rasterizer if cls is Rasterizer else cls)

    def __init__(
        self, near: float = 0.01, dilation: float = 0.3, antialiased: bool = False, threads: int | None = None
    ):
        if not near > 0 or not 0 <= dilation < np.inf:
            raise ValueError(f"near must be positive and dilation not negative, not {near} and {dilation}")
        if threads is not None and threads < 1:
            raise ValueError(f"threads must be at least 1, not {threads}")
        self.near, self.dilation, self.antialiased, self.threads = near, dilation, antialiased, threads
        self._last = None

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
        """Draw Gaussians over black: log_scales are natural logarithms, quats w x y z of any length.

        colours: channels, or spherical harmonics (k = 1, 4, 9, 16; `harmonics`), seen from the camera.
        features: more channels, blended into a picture of their own.
        Raises: ValueError: an array's type, shape or layout, a value that is not finite, a zero quaternion (index).
        """
        raise NotImplementedError

    def backward(
        self,
        grad_colour: Float32[Array, "h w c"],
        grad_alpha: Float32[Array, "h w"] | None = None,
        grad_depth: Float32[Array, "h w"] | None = None,
        grad_features: Float32[Array, "h w f"] | None = None,
    ) -> Gradients:
        """Gradients of a loss at the last forward, from its gradients by the pictures (None: zero).

        The arrays given to forward must not have changed since. By alpha's clamp at .99, the gradient through a
        clamped alpha is 0. Raises: ValueError: no forward yet, or an array's type, shape or layout.
        """
        raise NotImplementedError

    def contributions(self, weights: Float32[Array, "h w c"] | None = None) -> Contributions:
        """Blend weights of the last forward, and the map `weights` carried back onto the Gaussians by them."""
        raise NotImplementedError

    @property
    def drawn(self) -> Bool[Array, "n"]:
        """Which Gaussians of the last forward may have a pixel; the gradients of all others are 0."""
        raise NotImplementedError

    def _forwarded(self):
        if self._last is None:
            raise ValueError("nothing was drawn yet: call forward first")
        return self._last


def check(array, name: str, shape: tuple[int, ...], dtype=np.float32) -> None:
    """Raises: ValueError: not an array of this type and shape, or one that is not C-contiguous."""
    if not isinstance(array, np.ndarray) or array.dtype != dtype:
        kind = getattr(array, "dtype", type(array).__name__)
        raise ValueError(f"{name} must be an array of {np.dtype(dtype).name}, not {kind}")
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, not {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name} must be C-contiguous: use numpy.ascontiguousarray")


def columns(array) -> int:
    """Values in the last axis, where there is one."""
    return np.shape(array)[-1] if np.ndim(array) else 0


def check_gaussians(arrays: dict[str, Array | None]) -> None:
    """Check what `forward` is given, by its names, features last and perhaps None.

    Raises: ValueError: an array's type, shape or layout, a value that is not finite, a zero quaternion (index).
    """
    check_shapes(arrays)
    find_invalid({name: array for name, array in arrays.items() if array is not None})


def check_shapes(arrays: dict[str, Array | None]) -> None:
    """`check_gaussians` without a look at the values. Raises: ValueError: an array's type, shape or layout."""
    means, colours, features = arrays["means"], arrays["colours"], arrays["features"]
    n = len(means) if np.ndim(means) else 0
    shapes = {"means": (n, 3), "log_scales": (n, 3), "quats": (n, 4), "opacity_logits": (n,)}
    shapes["colours"] = (n, columns(colours))
    if np.ndim(colours) == 3:
        if colours.shape[1] not in (1, 4, 9, 16):
            raise ValueError(f"colours has {colours.shape[1]} coefficients; 1, 4, 9 or 16 make whole degrees")
        shapes["colours"] = (n, colours.shape[1], 3)
    if features is not None:
        shapes["features"] = (n, columns(features))
    for name, shape in shapes.items():
        check(arrays[name], name, shape)


def find_invalid(arrays: dict[str, Array]) -> None:
    """Raises: ValueError: a value that is not finite, or a quaternion that is zero, with the Gaussian's index."""
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            bad = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(1))
            raise ValueError(f"{name} of Gaussian {bad[0]} is not finite ({len(bad)} such)")
    zero = np.flatnonzero(np.abs(arrays["quats"]).max(1, initial=0) < 1e-36)
    if len(zero):
        raise ValueError(f"the quaternion of Gaussian {zero[0]} is zero")


def check_camera(camera: Camera) -> None:
    """Raises: ValueError: a size, a focal length or a number of the camera that no picture can have."""
    if not (0 < camera.width < 1 << 15 and 0 < camera.height < 1 << 15):
        raise ValueError(f"a picture has 1 to 32767 pixels a side, not {camera.width} x {camera.height}")
    inner = [camera.fx, camera.fy, camera.cx, camera.cy]
    values = np.concatenate([np.ravel(camera.rotation), np.ravel(camera.translation), inner]).astype(np.float32)
    if values.shape != (16,) or not np.isfinite(values).all():
        raise ValueError("a camera needs a 3 x 3 rotation and a translation of 3, all finite")
    if not (camera.fx > 0 and camera.fy > 0):
        raise ValueError(f"a camera's focal lengths must be positive, not {camera.fx} and {camera.fy}")
