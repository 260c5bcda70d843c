"""Constraints of a fit: where Gaussians may be and what they may look like, applied at every step."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

NEEDLE = np.log(3.0)  # the longest axis over the middle one: flat Gaussians are allowed, needles are not
FLAT = np.log(10.0)  # the longest axis over the shortest
LOGITS = (-8.0, 6.0)


@runtime_checkable
class Constraints(Protocol):
    """The first `fixed` Gaussians are never pruned, relocated or perturbed; the first `discs` are the ground's."""

    fixed: int
    discs: int
    detail: float  # typical size of a detail, in world units
    shape: tuple[int, int]  # rows and columns of the discs
    smoothing: float | None  # cells over which the gradients of their heights are blurred; None: heights stay

    def project_parameters(self, values: dict[str, Array]) -> None:
        """Project parameters onto what is allowed, in place."""
        ...

    def find_misplaced(self, values: dict[str, Array]) -> Bool[Array, "n"]:
        """Which Gaussians are where none can be: they are relocated."""
        ...


class FreeConstraints:
    """Constraints without knowledge of the scene, as in ordinary 3D Gaussian splatting: only sizes are bounded.

    detail: typical distance between neighbours. extent: the scene's size.
    """

    def __init__(self, detail: float, extent: float):
        self.fixed, self.discs, self.detail, self.extent = 0, 0, detail, extent
        self.shape: tuple[int, int] = (0, 0)
        self.smoothing: float | None = None

    def project_parameters(self, values: dict[str, Array]) -> None:
        """Allows neither needles nor Gaussians as large as the scene."""
        clip_sizes(values["log_scales"], 0.02 * self.detail, 0.1 * self.extent)
        np.clip(values["opacity_logits"], *LOGITS, out=values["opacity_logits"])

    def find_misplaced(self, values: dict[str, Array]) -> Bool[Array, "n"]:
        """Finds none."""
        return np.zeros(len(values["means"]), bool)


def clip_sizes(log_scales: Array, least: float, most: float) -> None:
    """Clip sizes in place and thicken needles: no axis is shorter than the longest by more than the factor of FLAT, the
    middle one (of equal ones the later) by no more than that of NEEDLE."""
    np.clip(log_scales, np.log(least), np.log(most), out=log_scales)
    a, b, c = (np.ascontiguousarray(log_scales[:, k]) for k in range(3))  # far faster than along an axis of 3
    longest = np.maximum(np.maximum(a, b), c)
    for axis in (a, b, c):
        np.maximum(axis, (longest - FLAT).astype(axis.dtype), out=axis)
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    raised = np.maximum(middle, (longest - NEEDLE).astype(middle.dtype))
    b_a, c_a, c_b = b < a, c < a, c < b
    for k, (axis, is_middle) in enumerate(((a, b_a != c_a), (b, b_a == c_b), (c, c_a != c_b))):
        log_scales[:, k] = np.where(is_middle, raised, axis)
