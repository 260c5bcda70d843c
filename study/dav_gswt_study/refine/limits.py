"""Bounds of the change of Gaussians: greatest at a seam, falling with the distance, zero at the border of a tile.

A Gaussian that reaches a border continues in the neighbouring tile, so it keeps its bits. Changes fade towards it.
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
    """The greatest change of each Gaussian, 0 if it must not change.

    share: of the full bounds. colour: of each channel, in [0, 1]. opacity: of the logit. position: along each axis, in
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


def find_seam(labels: UInt8[Array, "n n"]) -> Bool[Array, "n n"]:
    """The cells on either side of the seam between a tile's centre and its frame.

    The seams between strips and the corner patch are not included: they cross the border.
    """
    centre = labels == CENTRE
    found = np.zeros_like(centre)
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        apart = centre[one] != centre[other]
        found[one] |= apart
        found[other] |= apart
    return found


def compute_shares(labels: UInt8[Array, "n n"], reach: float, margin: float) -> Float[Array, "n n"]:
    """1 at the seam, falling as cos^2 to 0 at `reach` cells, times a smooth rise over `margin` cells at the border."""
    cut = find_seam(labels)
    if not cut.any():
        return np.zeros(labels.shape)
    away = np.minimum(distance_transform_edt(~cut) / reach, 1)
    k = np.arange(len(labels)) + 0.5
    rise = np.clip(np.minimum(k, len(labels) - k) / margin, 0, 1)
    rise = rise**2 * (3 - 2 * rise)
    return np.cos(0.5 * np.pi * away) ** 2 * np.minimum(rise[:, None], rise)


def border_clearance(field: GaussianField, side: float) -> Float[Array, "n"]:
    """The distance from the rim of each Gaussian to the nearest border of its tile, world units; negative beyond it."""
    ends = RIM * np.sqrt(np.diagonal(compute_covariances(field), axis1=1, axis2=2)[:, :2])
    place = field.means[:, :2].astype(float)
    return (np.minimum(place, side - place) - ends).min(1)


def lookup_cells(field: GaussianField, values: Float[Array, "n n *c"], side: float) -> Float[Array, "k *c"]:
    """The value of the cell of each Gaussian's centre."""
    column, row = (np.clip((field.means[:, i] * len(values) / side).astype(int), 0, len(values) - 1) for i in (0, 1))
    return values[row, column]


def compute_bounds(
    field: GaussianField, share: Float[Array, "n n"], side: float, colour: float, opacity: float, position: float
) -> Bounds:
    """The bounds of a tile's Gaussians. position: in world units; no Gaussian is moved over a border."""
    room = border_clearance(field, side)
    own = np.where(room > 0, lookup_cells(field, share, side), 0.0)
    return Bounds(own, own * colour, own * opacity, np.minimum(own * position, 0.5 * np.maximum(room, 0)))
