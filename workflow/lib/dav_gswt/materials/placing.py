"""Placing an object: its Gaussians turned, scaled and moved to a foot."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField


def turn_rows(angle: Float[Array, "n"]) -> Float[Array, "n 4"]:
    """Cosine and sine of angles in radians, and of their halves."""
    return np.stack([np.cos(angle), np.sin(angle), np.cos(angle / 2), np.sin(angle / 2)], 1)


def turn_and_scale(
    field: GaussianField, way: Float[Array, "n 4"], size: Float[Array, "n"], foot: Float[Array, "n 3"]
) -> GaussianField:
    """Gaussians about a foot each, turned counter-clockwise, scaled, and moved to the foot.

    Args:   way: of `turn_rows`.
    """
    (cos, sin), (x, y, z) = way[:, :2].T, field.means.astype(float).T
    means = size[:, None] * np.stack([cos * x - sin * y, sin * x + cos * y, z], 1) + foot
    (c, s), (qw, qx, qy, qz) = way[:, 2:].astype(np.float32).T, field.quats.T
    quats = np.stack([c * qw - s * qz, c * qx - s * qy, c * qy + s * qx, c * qz + s * qw], 1)
    log_scales = field.log_scales + np.log(size)[:, None].astype(np.float32)
    return replace(field, means=means.astype(np.float32), log_scales=log_scales, quats=quats)
