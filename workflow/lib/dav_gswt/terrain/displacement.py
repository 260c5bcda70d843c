"""Displacement of Gaussians by a height field: centres move up by the height, covariances follow the Jacobian."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.field import GaussianField
from dav_gswt.terrain.heights import HeightField

THINNEST = 1e-30  # lower bound of an axis that the map flattens to zero


def displace_means(
    field: GaussianField, heights: HeightField, corner: Float[Array, "3"], origin: Float[Array, "3"]
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """Move centres from (x, y, z) to (x, y, z + h(x, y)); also returns the surface's slope at each.

    Heights above the surface stay along z, so upright objects stay upright, no Gaussian leaves the column of its tile
    and neighbouring tiles still meet. Shapes are unchanged; see `displaced_axes`.

    Args:   corner: world position of the origin of the field's means. origin: world position of the origin of the
            returned means.
    """
    means = field.means.astype(float)
    height, slope = heights.at(means[:, 0] + corner[0], means[:, 1] + corner[1])
    means += corner - origin
    means[:, 2] += height
    return replace(field, means=means.astype(np.float32)), slope


Slope = Float[Array, "n 2"] | Float[Array, "n 3 3"]  # of a height field; on a sphere J itself


def displaced_axes(field: GaussianField, slope: Slope) -> Float[Array, "n 3 3"]:
    """A = J R S of every Gaussian on a surface of these slopes; its covariance is A A^T = J Sigma J^T.

    J = [[1, 0, 0], [0, 1, 0], [h_x, h_y, 1]] is the derivative of `displace_means`; its determinant is 1. The columns
    of R S are the Gaussian's axes, scaled by their standard deviations. Discs on a slope are stretched along it, so
    they stay as dense as on level ground. On a sphere J is given (see `sphere.bend`).
    """
    rotation = Rotation.from_quat(field.quats.astype(float), scalar_first=True).as_matrix()
    axes = rotation * np.exp(field.log_scales.astype(float))[:, None]
    if slope.ndim == 3:
        return slope @ axes
    axes[:, 2] += slope[:, 0, None] * axes[:, 0] + slope[:, 1, None] * axes[:, 1]
    return axes


def displace_field(
    field: GaussianField, heights: HeightField, corner: Float[Array, "3"], origin: Float[Array, "3"]
) -> GaussianField:
    """The field on the surface, as Gaussians that any rasterizer draws: `displace_means`, shapes by `displaced_axes`.

    A is factored as R' S' V^T; its singular values are the new scales, so needles keep their digits. Where the surface
    is level a Gaussian keeps its bits.
    """
    raised, slope = displace_means(field, heights, corner, origin)
    steep = np.flatnonzero((slope != 0).any(1))
    rotation, scales, _ = np.linalg.svd(displaced_axes(field[steep], slope[steep]))
    rotation[:, :, 2] *= np.sign(np.linalg.det(rotation))[:, None]
    quats, log_scales = field.quats.copy(), field.log_scales.copy()
    quats[steep] = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    log_scales[steep] = np.log(np.maximum(scales, THINNEST))
    return replace(raised, quats=quats, log_scales=log_scales)
