"""A field laid over a height field: centres rise with the surface, covariances follow its Jacobian."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.field import GaussianField
from dav_gswt.terrain.heights import Heights

THINNEST = 1e-30  # of an axis that the map has flattened to nothing


def lifted(
    field: GaussianField, heights: Heights, corner: Float[Array, "3"], about: Float[Array, "3"]
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """Centres over the surface: (x, y, z) goes to (x, y, z + h(x, y)); with the surface's slope at each.

    What stands, stands upright: heights above the surface are kept along z. So nothing leaves its tile's column,
    nothing folds over itself however bent the surface is, and tiles meet as they did. Shapes are as before (`axes`).

    Args:   corner: where in the world the field's means count from. about: where the new ones do.
    """
    means = field.means.astype(float)
    height, slope = heights.at(means[:, 0] + corner[0], means[:, 1] + corner[1])
    means += corner - about
    means[:, 2] += height
    return replace(field, means=means.astype(np.float32)), slope


def axes(field: GaussianField, slope: Float[Array, "n 2"]) -> Float[Array, "n 3 3"]:
    """A = J R S of every Gaussian on a surface with these slopes: its covariance is A A^T = J Sigma J^T.

    J = [[1, 0, 0], [0, 1, 0], [h_x, h_y, 1]] is the derivative of `lifted`; its determinant is 1. Discs on a slope are
    drawn out along it, so that they stay as dense as on level ground. R S has the Gaussian's axes as columns, as long
    as their standard deviations.
    """
    turn = Rotation.from_quat(field.quats.astype(float), scalar_first=True).as_matrix()
    own = turn * np.exp(field.log_scales.astype(float))[:, None]
    own[:, 2] += slope[:, 0, None] * own[:, 0] + slope[:, 1, None] * own[:, 1]
    return own


def draped(
    field: GaussianField, heights: Heights, corner: Float[Array, "3"], about: Float[Array, "3"]
) -> GaussianField:
    """The field over the surface, as a field that any rasterizer draws: `lifted`, and shapes by `axes`.

    A is factored as R' S' V^T: its singular values are the new scales, and needles keep their digits. Where the
    surface is level a Gaussian keeps its bits.
    """
    raised, slope = lifted(field, heights, corner, about)
    steep = np.flatnonzero((slope != 0).any(1))
    turn, scales, _ = np.linalg.svd(axes(field[steep], slope[steep]))
    turn[:, :, 2] *= np.sign(np.linalg.det(turn))[:, None]
    quats, log_scales = field.quats.copy(), field.log_scales.copy()
    quats[steep] = Rotation.from_matrix(turn).as_quat(scalar_first=True)
    log_scales[steep] = np.log(np.maximum(scales, THINNEST))
    return replace(raised, quats=quats, log_scales=log_scales)
