"""The C++ rasterizer on NumPy arrays, without copies.

Results have the same bits for any number of threads, but differ in the last bits between instruction sets. The
environment variables DAV_GSWT_ISA and DAV_GSWT_THREADS set the instruction set and the number of threads.
"""

import os
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import _core, interface
from dav_gswt.raster.interface import (
    AdamStep,
    Contributions,
    Forward,
    GaussianArrays,
    Gradients,
    PictureGradients,
    Rendering,
)
from dav_gswt.threads import default_threads

MIN_PARALLEL = 1 << 15  # Gaussians plus pixels below which a second thread costs more than it gains


instruction_sets = _core.instruction_sets  # that this processor has and the core was built for, best first


def default_instruction_set() -> str:
    """DAV_GSWT_ISA, or the best. Raises: ValueError: this processor lacks it."""
    names = instruction_sets()
    name = os.environ.get("DAV_GSWT_ISA") or names[0]
    if name not in names:
        raise ValueError(f"DAV_GSWT_ISA={name}: this processor has {', '.join(names)}; choose one of them")
    return name


class Rasterizer(interface.Rasterizer):
    """See `interface.Rasterizer`.

    A Gaussian that cannot have a pixel is culled by its mean and scales; its other values are not checked.
    threads, instruction_set: see `default_threads`, `default_instruction_set`.
    """

    def __init__(self, instruction_set: str | None = None, **options: Any):
        super().__init__(**options)
        self.threads = self.threads or default_threads()
        self._core = _core.Context(instruction_set or default_instruction_set())

    def _render(self, gaussians: GaussianArrays, camera: Camera) -> tuple[Rendering, int]:
        arrays, size = vars(gaussians).values(), (camera.height, camera.width)
        shapes = (*size, gaussians.colours.shape[-1]), size, size
        rendering = Rendering(*(np.empty(shape, np.float32) for shape in shapes))
        threads = 1 if len(gaussians.means) + size[0] * size[1] < MIN_PARALLEL else self.threads
        view = _pack_camera(camera, self.near, self.dilation), *size[::-1], bool(camera.orthographic), self.antialiased
        if not self._core.forward(*arrays, None, *view, *vars(rendering).values(), None, threads):
            gaussians.check_values()
        return rendering, threads

    def _differentiate(self, last: Forward, given: PictureGradients) -> Gradients:
        out = Gradients(**{name: np.empty(a.shape, np.float32) for name, a in vars(last.gaussians).items()})
        parts = vars(last.gaussians), vars(last.rendering), given, vars(out)
        arrays = (array for part in parts for array in (*part.values(), None))  # None: features, which nothing uses
        by_camera = np.empty(6, np.float32)  # by the camera's motion, which nothing uses
        self._core.backward(*arrays, by_camera, last.state)
        return out

    def _contribute(self, last: Forward, weights: Float32[Array, "h w c"]) -> Contributions:
        n = len(last.gaussians.means)
        total, maximum = (np.empty(n, np.float32) for _ in range(2))
        mapped = np.empty((n, weights.shape[2]), np.float32)
        self._core.contributions(weights, total, maximum, mapped, last.state)
        return Contributions(total, maximum, mapped)

    def _visible(self, last: Forward) -> Bool[Array, "n"]:
        found = np.empty(len(last.gaussians.means), bool)
        self._core.drawn(found)
        return found


def compute_loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None,
    structure: float,
    threads: int | None,
) -> tuple[float, Float32[Array, "h w c"]]:
    """See `backends.loss`."""
    gradient = np.empty(image.shape, np.float32)
    threads = 1 if image.size < MIN_PARALLEL else threads or default_threads()
    return _core.loss(default_instruction_set(), image, target, weight, structure, gradient, threads), gradient


def step_adam(s: AdamStep) -> None:
    """See `backends.adam`."""
    threads = 1 if s.values.size < MIN_PARALLEL else s.threads or default_threads()
    arrays = s.values, s.gradient, s.first, s.second, s.rows
    _core.adam(default_instruction_set(), *arrays, s.step, s.rates, *s.betas, s.epsilon, threads)


def add_colours(
    image: Float32[Array, "h w 3"],
    weight: Float32[Array, "h w"],
    camera: Camera,
    points: Float32[Array, "n 3"],
    heights: Float32[Array, "m"],
    sums: tuple[Float32[Array, "m n 3"], Float32[Array, "m n"], Float32[Array, "m n"]],
    threads: int | None = None,
) -> None:
    """Add a photo's bilinear colours at points of the world moved up by each height, where it counts.

    sums: of colours, of their squares over the channels, and how many were added, in place. All arrays must be
    C-contiguous.
    """
    n, m = len(points), len(heights)
    threads = 1 if m * n < MIN_PARALLEL else threads or default_threads()
    inner = [camera.fx, camera.fy, camera.cx, camera.cy]
    numbers = np.concatenate([np.ravel(camera.rotation), np.ravel(camera.translation), inner]).astype(np.float32)
    _core.add_colours(image, weight, numbers, points, heights, *sums, threads)


def _pack_camera(camera: Camera, near: float, dilation: float) -> Float32[Array, "21"]:
    """The camera's numbers as the core takes them: its centre as two parts, as float32 alone is coarse far out."""
    inner = [camera.fx, camera.fy, camera.cx, camera.cy, near, dilation]
    centre = np.asarray(camera.centre, float)
    coarse = centre.astype(np.float32)
    return np.concatenate([np.ravel(camera.rotation), coarse, centre - coarse, inner]).astype(np.float32)
