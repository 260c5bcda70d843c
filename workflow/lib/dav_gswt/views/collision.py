"""Collision test of camera positions with the ground and with solid Gaussians."""

import logging

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.uncertainty.finite import format_names

_log = logging.getLogger(__name__)

SOLID = 0.5  # opacity from which a Gaussian counts as solid


def drop_blocked(candidates: Candidates, field: GaussianField, grid: Ground) -> Candidates:
    """Keep the candidates that are above the ground and not within one standard deviation of a solid Gaussian.

    Raises: InputError: none is left.
    """
    if not candidates:
        return candidates
    centres = np.stack([camera.centre for _, camera in candidates])
    below, inside = find_below_ground(centres, grid), find_inside_objects(centres, field)
    blocked = below | inside
    if blocked.all():
        names = format_names(blocked, [pose.name for pose, _ in candidates])
        raise InputError(
            f"pose {names}: all are below the ground or inside an object; no photo can be taken there. Set `poses`, "
            "`feasibility` or `min_elevation` of the scene, or check its ground"
        )
    if blocked.any():
        _log.info("%d candidate poses are below the ground, %d inside an object: left out", below.sum(), inside.sum())
    return [candidate for candidate, out in zip(candidates, blocked, strict=True) if not out]


def find_below_ground(centres: Float[Array, "n 3"], grid: Ground) -> Bool[Array, "n"]:
    """Which positions are at or below the surface; none outside the grid."""
    return grid.contains(centres) & (centres[:, 2] <= grid.height_at(centres))


def find_inside_objects(centres: Float[Array, "n 3"], field: GaussianField) -> Bool[Array, "n"]:
    """Which positions are within one standard deviation of a solid Gaussian's centre."""
    solid = np.flatnonzero(expit(field.opacity_logits) >= SOLID)
    reach = np.exp(field.log_scales[solid].max(1).astype(float))
    # most Gaussians reach no position at all: they are left out before each position looks at the others
    apart, _ = cKDTree(centres).query(field.means[solid], distance_upper_bound=2 * reach.max(initial=1e-30))
    solid = solid[np.asarray(apart) <= 1.01 * reach]
    means, scales = field.means[solid].astype(float), np.exp(field.log_scales[solid].astype(float))
    found = np.zeros(len(centres), bool)
    for i, centre in enumerate(centres):
        apart = means - centre
        near = np.flatnonzero((apart**2).sum(1) <= scales.max(1) ** 2)
        if len(near):
            w, x, y, z = field.quats[solid][near].T
            own = Rotation.from_quat(np.stack([x, y, z, w], 1)).inv().apply(apart[near])
            found[i] = (((own / scales[near]) ** 2).sum(1) <= 1).any()
    return found
