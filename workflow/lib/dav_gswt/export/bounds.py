"""The box that a spool's Gaussians fill, their rims included: what scene formats want as an extent."""

import numpy as np
from jaxtyping import Float, Float64
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation

from dav_gswt.export.axes import turn_points, turn_quats
from dav_gswt.export.spool import Spool
from dav_gswt.raster.interface import RIM

Box = tuple[Float64[Array, "3"], Float64[Array, "3"]]  # the smallest and the largest of each coordinate


def find_box(spool: Spool, rotation: Float[Array, "3 3"]) -> Box:
    """The box along the axes of a format, as the renderer draws Gaussians: to RIM standard deviations.

    rotation: of `axes.AXES`. Raises: ValueError: there is no Gaussian.
    """
    if not len(spool):
        raise ValueError("nothing has no box")
    columns = zip(spool.read("means"), spool.read("log_scales"), spool.read("quats"), strict=True)
    ends = [_find_ends(*values, rotation) for values in columns]
    return np.min([low for low, _ in ends], 0), np.max([high for _, high in ends], 0)


def unite_boxes(boxes: list[Box]) -> Box:
    """The box about boxes, at least one."""
    return np.min([low for low, _ in boxes], 0), np.max([high for _, high in boxes], 0)


def _find_ends(
    means: Float[Array, "n 3"],
    log_scales: Float[Array, "n 3"],
    quats: Float[Array, "n 4"],
    rotation: Float[Array, "3 3"],
) -> Box:
    """Along an axis an ellipsoid reaches as far as the deviation in that direction times RIM."""
    points = turn_points(means, rotation).astype(float)
    axes = Rotation.from_quat(turn_quats(quats, rotation), scalar_first=True).as_matrix()
    reach = RIM * np.sqrt(np.einsum("nij,nj->ni", axes**2, np.exp(2 * log_scales.astype(float))))
    return (points - reach).min(0), (points + reach).max(0)
