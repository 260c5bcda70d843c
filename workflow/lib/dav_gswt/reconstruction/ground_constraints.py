"""The rules of a ground with things on it, for the fit.

Discs keep to their cell, to the surface's tangent plane and to near-full opacity; their heights move nearly together
(the gradient is blurred a little over the grid). The underlay follows them: no sky shines through. Things stay under
the ceiling: what is above it the photos see through.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.raster import Gradients
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.discs import THICKNESS, quaternions
from dav_gswt.reconstruction.fitting.constraints import LOGITS, bounded
from dav_gswt.reconstruction.ground import Ground, smoothed

TOGETHER = 0.5  # cells over which heights move together
HOME = 0.49  # spacings that a disc may leave its cell's centre
DISC_SIZES = 0.5, 1.5  # spacings
THING_SIZES = 0.1, 1.5  # spacings: from the finest detail the photos resolve to what a disc covers
DISC_LOGITS = 2.5, 6.0


class OnGround:
    """Rules for a field whose first Gaussians are the discs of `grid`, row by row, and then their underlay.

    ceiling: how high above the surface anything may be, by cell.
    """

    def __init__(self, grid: Ground, ceiling: Float[Array, "rows columns"]):
        self.discs, self.reach = grid.heights.size, grid.spacing
        self.fixed = self.discs + underlay.count(grid)
        self.grid, self.ceiling = grid, replace(grid, heights=ceiling)
        self.home = grid.centres[:, :2].astype(np.float32)

    def guide(self, gradients: Gradients) -> None:
        """Heights move together; discs turn with the surface (see `keep`)."""
        up = gradients.means[: self.discs, 2].reshape(self.grid.shape)
        gradients.means[: self.discs, 2] = smoothed(up, TOGETHER).ravel()
        gradients.quats[: self.discs] = 0
        for part in vars(gradients).values():
            if part is not None and len(part) > self.discs:
                part[self.discs : self.fixed] = 0

    def keep(self, values: dict[str, Array]) -> None:
        """Project onto what a ground with things on it may be."""
        n, s = self.discs, self.grid.spacing
        means, scales, logits = values["means"], values["log_scales"], values["opacity_logits"]
        np.clip(means[:n, :2], self.home - HOME * s, self.home + HOME * s, out=means[:n, :2])
        values["quats"][:n] = quaternions(*(g.ravel() for g in self.surface(values).slopes()))
        np.clip(scales[:n, :2], *np.log(np.multiply(DISC_SIZES, s)), out=scales[:n, :2])
        scales[:n, 2] = np.log(THICKNESS * s)
        np.clip(logits[:n], *DISC_LOGITS, out=logits[:n])
        underlay.follow(self.grid, values)
        bounded(scales[self.fixed :], *np.multiply(THING_SIZES, s))
        np.clip(logits[self.fixed :], *LOGITS, out=logits[self.fixed :])

    def lost(self, values: dict[str, Array]) -> Bool[Array, "n"]:
        """Things under the ground, above the ceiling, or off the grid."""
        things = values["means"][self.fixed :]
        above = things[:, 2] - self.surface(values).height_at(things)
        out = np.zeros(len(values["means"]), bool)
        out[self.fixed :] = (above < -self.grid.spacing) | (above > self.ceiling.height_at(things))
        out[self.fixed :] |= ~self.grid.contains(things)
        return out

    def surface(self, values: dict[str, Array]) -> Ground:
        """The grid with the heights that its discs have now."""
        heights = values["means"][: self.discs, 2].reshape(self.grid.shape)
        return replace(self.grid, heights=heights.astype(float))
