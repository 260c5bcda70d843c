"""Constraints of a fit over a ground with objects on it: where Gaussians may be and what they may look like.

Discs stay in their cell, tangent to the surface and nearly opaque; their heights move together (the gradient is
slightly blurred over the grid). The underlay follows them, so that no sky shines through. Objects stay below a ceiling,
above which the photos see through.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt import arrays
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

    def project_parameters(self, values: dict[str, Any]) -> None:
        """Discs onto their cells, tangents and sizes; the underlay below them; objects onto their sizes."""
        n, s, (rows, columns) = self.discs, self.grid.spacing, self.shape
        means, scales, logits = values["means"], values["log_scales"], values["opacity_logits"]
        xp, cells = arrays.namespace(means), means[:n].reshape(rows, columns, 3)
        east = arrays.to_single(self.grid.west + (arrays.count_up(columns, means) + 0.5) * s)
        north = arrays.to_single(self.grid.south + (arrays.count_up(rows, means) + 0.5) * s)[:, None]
        for axis, centre in enumerate((east, north)):
            cells[..., axis] = xp.clip(cells[..., axis], centre - MAX_OFFSET * s, centre + MAX_OFFSET * s)
        slopes = arrays.measure_slopes(arrays.to_double(cells[..., 2]), s)
        values["quats"][:n] = slopes_to_quaternions(*(slope.reshape(-1) for slope in slopes))
        scales[:n, :2] = xp.clip(scales[:n, :2], *np.log(np.multiply(DISC_SIZES, s)))
        arrays.fill(scales[:n, 2], np.log(THICKNESS * s))
        logits[:n] = xp.clip(logits[:n], *DISC_LOGITS)
        update_underlay(self.grid, values)
        clip_sizes(scales[self.fixed :], *np.multiply(OBJECT_SIZES, s))
        logits[self.fixed :] = xp.clip(logits[self.fixed :], *LOGITS)

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


def clip_sizes(log_scales: Any, least: float, most: float) -> None:
    """Clip sizes in place and thicken needles: no axis is shorter than the longest by more than the factor of FLAT, the
    middle one (of equal ones the later) by no more than that of NEEDLE."""
    xp, bounds = arrays.namespace(log_scales), (np.log(least), np.log(most))
    columns = [arrays.to_single(xp.clip(log_scales[:, k], *bounds)) for k in range(3)]  # far faster than an axis of 3
    longest = xp.maximum(xp.maximum(columns[0], columns[1]), columns[2])
    a, b, c = (xp.maximum(column, arrays.to_single(longest - FLAT)) for column in columns)
    middle = xp.maximum(xp.minimum(a, b), xp.minimum(xp.maximum(a, b), c))
    raised = xp.maximum(middle, arrays.to_single(longest - NEEDLE))
    b_a, c_a, c_b = b < a, c < a, c < b
    for k, (axis, is_middle) in enumerate(((a, b_a != c_a), (b, b_a == c_b), (c, c_a != c_b))):
        log_scales[:, k] = xp.where(is_middle, raised, axis)
