"""How far a Gaussian may be changed: the most beside a cut, less and less away from it, not at all over a border.

What reaches a tile's border belongs to the colour of that edge, and neighbours continue one another there: it keeps
its bits. What is changed inside keeps clear of the border too, and changes fade towards it, so that no step arises
between what was changed and what may not be.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.field import GaussianField
from dav_gswt.lod.merge import compute_covariances
from dav_gswt.raster.interface import RIM
from dav_gswt.tiles.layout import CENTRE


@dataclass(frozen=True)
class Bounds:
    """The most that each Gaussian may be changed by, either way; 0 for those that must not be.

    share: of the full bounds. colour: of each channel, in [0, 1]. opacity: of its logit. position: along each axis, in
    world units.
    """

    share: Float[Array, "n"]
    colour: Float[Array, "n"]
    opacity: Float[Array, "n"]
    position: Float[Array, "n"]

    @property
    def free(self) -> Bool[Array, "n"]:
        return self.share > 0

    @property
    def scale(self) -> Float32[Array, "n 7"]:
        """The bounds of red, green, blue, opacity, x, y and z."""
        columns = [self.colour] * 3 + [self.opacity] + [self.position] * 3
        return np.stack(columns, 1).astype(np.float32)


def seam(labels: UInt8[Array, "n n"]) -> Bool[Array, "n n"]:
    """The cells on either side of the cut between a tile's centre and its frame.

    The cuts of strips against the corner patch are no part of it: they run over the border, the same in all tiles with
    that edge colour.
    """
    centre = labels == CENTRE
    found = np.zeros_like(centre)
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        apart = centre[one] != centre[other]
        found[one] |= apart
        found[other] |= apart
    return found


def shares(labels: UInt8[Array, "n n"], reach: float, margin: float) -> Float[Array, "n n"]:
    """1 at the cut, falling as cos^2 to 0 at `reach` cells; times a rise from the border over `margin` cells."""
    cut = seam(labels)
    if not cut.any():
        return np.zeros(labels.shape)
    away = np.minimum(distance_transform_edt(~cut) / reach, 1)
    k = np.arange(len(labels)) + 0.5
    rise = np.clip(np.minimum(k, len(labels) - k) / margin, 0, 1)
    rise = rise**2 * (3 - 2 * rise)
    return np.cos(0.5 * np.pi * away) ** 2 * np.minimum(rise[:, None], rise)


def clearance(field: GaussianField, side: float) -> Float[Array, "n"]:
    """From where each Gaussian ends to its tile's nearest border, in world units; negative where it reaches over it."""
    ends = RIM * np.sqrt(np.diagonal(compute_covariances(field), axis1=1, axis2=2)[:, :2])
    place = field.means[:, :2].astype(float)
    return (np.minimum(place, side - place) - ends).min(1)


def in_cells(field: GaussianField, values: Float[Array, "n n *c"], side: float) -> Float[Array, "k *c"]:
    """Of each Gaussian, the value of the cell that its centre is in."""
    column, row = (np.clip((field.means[:, i] * len(values) / side).astype(int), 0, len(values) - 1) for i in (0, 1))
    return values[row, column]


def bounds(
    field: GaussianField, share: Float[Array, "n n"], side: float, colour: float, opacity: float, position: float
) -> Bounds:
    """Of a tile's Gaussians. position: in world units; none comes to reach a border that it did not."""
    room = clearance(field, side)
    own = np.where(room > 0, in_cells(field, share, side), 0.0)
    return Bounds(own, own * colour, own * opacity, np.minimum(own * position, 0.5 * np.maximum(room, 0)))
