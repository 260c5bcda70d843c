"""Occluders: which cells of an exemplar are hidden, seen from above, by what stands on the ground.

Gaussians follow the label of the cell that their centre is in, so a cut through a shrub leaves half a shrub, and one
under a flower's head a stalk without a head. A cut through such cells costs more (`energy.make_occluder_layer`).
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.tiles import compose
from dav_gswt.tiles.layout import Exemplar

ABOVE = 0.5  # cells over the ground discs' mean height, from which a Gaussian is an occluder: rough ground is none


def compute_cover(field: GaussianField, exemplar: Exemplar, height: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Share of each cell that is hidden by the occluders over it, at whatever height, in [0, 1].

    sum of opacity x 2 pi sigma_1 sigma_2 over the Gaussians whose centre is over the cell, sigma_1 and sigma_2 their
    two longer axes, as a share of the cell; at most 1. height: of the cells' ground; a cell where it is NaN
    has no occluder. A field without ground discs (one that was imported) has none at all.
    """
    if not field.ground.any():
        return np.zeros(height.shape)
    level = compose.bin_gaussians(field, exemplar, 1)
    cell = np.repeat(np.arange(height.size), np.diff(level.start))
    above = level.field.means[:, 2] - height.ravel()[cell]
    up = above > ABOVE * exemplar.spacing
    cell, occluding = cell[up], level.field[up]
    scales = np.sort(np.exp(occluding.log_scales.astype(float)), 1)
    opacity = 1 / (1 + np.exp(-occluding.opacity_logits.astype(float)))
    area = 2 * np.pi * opacity * scales[:, 1] * scales[:, 2] / exemplar.spacing**2
    return np.minimum(np.bincount(cell, area, height.size), 1.0).reshape(height.shape)
