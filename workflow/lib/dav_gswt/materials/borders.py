"""How the borders of a material run: how far they stray from their smooth course, and how that bends.

Over the signed distance d from the smooth course, the colour of the ground changes from one side's to the other's. If
P(d) is the share of the material's own colour there, and H(d) is 1 inside and 0 outside, the mean distance of the real
border from the smooth one is the integral of |H - P|. Blur counts as well: soft borders are drawn as frayed ones.
"""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter

SMOOTH = 0.05  # tile sides: standard deviation of the filter that gives the smooth course
SMOOTHER = 0.2  # the same of the filter against whose course bends are measured
REACH = 0.35  # tile sides: half-width of the band that is looked at
GAP = 0.07  # tile sides: half-width of a gap of what is counted, through which bends are measured
BAND = 0.5  # cells to either side of a distance that are averaged
FEW = 10  # cells, with fewer of which nothing is known of a distance


def measure_fray(
    features: Float[Array, "m m k"], own: Bool[Array, "m m"], counted: Bool[Array, "m m"], tile_side: float
) -> float | None:
    """Mean distance in cells of a material's borders from their smooth course; None where none is seen.

    own: cells of the material. counted: cells that are neither excluded nor of an object. tile_side: in cells.
    """
    smooth = gaussian_filter(own.astype(float), SMOOTH * tile_side, mode="nearest") > 0.5
    if smooth.all() or not smooth.any():
        return None
    away = np.where(smooth, distance_transform_edt(smooth) - 0.5, 0.5 - distance_transform_edt(~smooth))
    reach = int(REACH * tile_side)
    band = counted & (np.abs(away) <= reach)
    far = band & (np.abs(away) > reach / 2)
    inside, outside = features[far & smooth], features[far & ~smooth]
    if min(len(inside), len(outside)) < FEW:
        return None
    axis = inside.mean(0) - outside.mean(0)
    share = (features - outside.mean(0)) @ axis / max(float(axis @ axis), 1e-12)
    strayed = 0.0
    for distance in np.arange(-reach + 0.5, reach).tolist():
        here = band & (np.abs(away - distance) <= BAND)
        if here.sum() >= FEW:
            strayed += abs((distance > 0) - float(np.clip(share[here].mean(), 0, 1)))  # the mean: texture averages out
    return strayed


def measure_bend(own: Bool[Array, "m m"], counted: Bool[Array, "m m"], tile_side: float) -> float | None:
    """Mean distance in cells between the smooth course of borders and a still smoother one: 0 for straight ones.

    It is the area between the two over the length of the border. Narrow gaps of what is counted, as kerbs are, do not
    hide it. None where fewer than FEW cells of border are seen.
    """
    counted = distance_transform_edt(~counted) <= GAP * tile_side
    fine, coarse = (
        gaussian_filter(own.astype(float), share * tile_side, mode="nearest") > 0.5 for share in (SMOOTH, SMOOTHER)
    )
    crossings = sum(
        int((np.diff(fine, axis=axis) & np.delete(counted, 0, axis) & np.delete(counted, -1, axis)).sum())
        for axis in (0, 1)
    )
    length = np.pi / 4 * crossings  # of a line at a random angle to the grid
    return float(((fine != coarse) & counted).sum()) / length if length >= FEW else None
