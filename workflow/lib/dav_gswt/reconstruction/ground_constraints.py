"""Constraints of a fit over a ground with objects on it: where Gaussians may be and what they may look like.

Discs stay in their cell, tangent to the surface and nearly opaque; their heights move together (the gradient is
slightly blurred over the grid). The underlay follows them, so that no sky shines through. Objects stay below a ceiling,
above which the photos see through.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.reconstruction.discs import THICKNESS, count_underlay, slopes_to_quaternions, update_underlay
from dav_gswt.reconstruction.ground import Ground

SMOOTHING = 0.5  # cells: blur of the gradients of heights
MAX_OFFSET = 0.49  # spacings between a disc and its cell's centre
DISC_SIZES = 0.5, 1.5  # spacings
OBJECT_SIZES = 0.1, 1.5  # spacings: from the finest detail the photos resolve to a disc
DISC_LOGITS, LOGITS = (2.5, 6.0), (-8.0, 6.0)  # of discs, of objects
NEEDLE = np.log(3.0)  # the longest axis over the middle one: flat Gaussians are allowed, needles are not
FLAT = np.log(10.0)  # the longest axis over the shortest


class GroundConstraints:
    """Constraints of a field whose first Gaussians are the discs of `grid`, row by row, and then their underlay.

    The first `fixed` Gaussians are never pruned, relocated or perturbed; the first `discs` of them are the discs.
    ceiling: the largest height of objects above the surface, by cell. smoothing: cells over which the gradients of the
    discs' heights are blurred; None: the discs keep their heights. frozen: Gaussians after the underlay that stay as
    they are, and beside which none grow.
    """

    def __init__(
        self,
        grid: Ground,
        ceiling: Float[Array, "rows columns"],
        smoothing: float | None = SMOOTHING,
        frozen: int = 0,
    ):
        self.discs, self.detail = grid.heights.size, grid.spacing
        self.fixed = self.discs + count_underlay(grid) + frozen
        self.frozen = slice(self.fixed - frozen, self.fixed)
        self.shape: tuple[int, int] = grid.shape
        self.smoothing = smoothing
        self.grid, self.ceiling = grid, replace(grid, heights=ceiling)
        self.centres = grid.centres[:, :2].astype(np.float32)

    def project_parameters(self, values: dict[str, Array]) -> None:
        """Discs onto their cells, tangents and sizes; the underlay below them; objects onto their sizes."""
        n, s = self.discs, self.grid.spacing
        means, scales, logits = values["means"], values["log_scales"], values["opacity_logits"]
        np.clip(means[:n, :2], self.centres - MAX_OFFSET * s, self.centres + MAX_OFFSET * s, out=means[:n, :2])
        values["quats"][:n] = slopes_to_quaternions(*(g.ravel() for g in self.surface(values).slopes()))
        np.clip(scales[:n, :2], *np.log(np.multiply(DISC_SIZES, s)), out=scales[:n, :2])
        scales[:n, 2] = np.log(THICKNESS * s)
        np.clip(logits[:n], *DISC_LOGITS, out=logits[:n])
        update_underlay(self.grid, values)
        clip_sizes(scales[self.fixed :], *np.multiply(OBJECT_SIZES, s))
        np.clip(logits[self.fixed :], *LOGITS, out=logits[self.fixed :])

    def find_misplaced(self, values: dict[str, Array]) -> Bool[Array, "n"]:
        """Objects under the ground, above the ceiling, or off the grid."""
        occluders = values["means"][self.fixed :]
        above = occluders[:, 2] - self.surface(values).height_at(occluders)
        out = np.zeros(len(values["means"]), bool)
        out[self.fixed :] = (above < -self.grid.spacing) | (above > self.ceiling.height_at(occluders))
        out[self.fixed :] |= ~self.grid.contains(occluders)
        return out

    def surface(self, values: dict[str, Array]) -> Ground:
        """The grid with the current heights of its discs."""
        heights = values["means"][: self.discs, 2].reshape(self.grid.shape)
        return replace(self.grid, heights=heights.astype(float))


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
