"""How the borders of a material run: how far they stray from their smooth course, octave by octave.

The share of the material's own colour at each place, smoothed, has a course along which it is one half. The mean
distance between that course and the one of twice the width says how much the border strays at that width: 0 for
straight borders, and the narrowest widths see its fray.
"""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter

WIDTHS = (0.1, 0.05, 0.025, 0.0125)  # tile sides: standard deviations of the filters that give the courses
FINEST = 2.0  # cells: the narrowest width that labels and their colours resolve
BAND = 0.1  # tile sides: half-width of the band in which colours tell where the border is; its outer half has the two
GAP = 0.07  # tile sides: half-width of a gap of what is counted, through which strays are measured
FEW = 10  # cells, with fewer of which nothing is known


def measure_strays(share: Float[Array, "m m"], counted: Bool[Array, "m m"], tile_side: float) -> list[float] | None:
    """Mean distances in cells between the border's courses of each of WIDTHS and of twice that width, widest first.

    It is the area between the two over the length of the wider one. Widths below FINEST have none. Narrow gaps of what
    is counted, as kerbs are, do not hide it. None where fewer than FEW cells of border are seen.

    Args:
        share: of the material. counted: cells that are neither excluded nor of an object. tile_side: in cells.
    """
    counted = distance_transform_edt(~counted) <= GAP * tile_side
    widths = [width * tile_side for width in (2 * WIDTHS[0], *WIDTHS) if width * tile_side >= FINEST]
    courses = [gaussian_filter(share, width, mode="nearest") > 0.5 for width in widths]
    strays = []
    for wide, narrow in zip(courses, courses[1:], strict=False):
        crossings = sum(
            int((np.diff(wide, axis=axis) & np.delete(counted, 0, axis) & np.delete(counted, -1, axis)).sum())
            for axis in (0, 1)
        )
        length = np.pi / 4 * crossings  # of a line at a random angle to the grid
        if length < FEW:
            return None
        strays.append(float(((wide != narrow) & counted).sum()) / length)
    return strays or None


def measure_share(
    features: Float[Array, "m m k"], own: Bool[Array, "m m"], counted: Bool[Array, "m m"], tile_side: float
) -> Float[Array, "m m"]:
    """Share of a material's colour in the cells beside its borders; elsewhere, and where colours do not tell, 1 or 0.

    Args:   own: cells of the material.
    """
    away = np.maximum(distance_transform_edt(own), distance_transform_edt(~own)) - 0.5
    band = counted & (away <= BAND * tile_side)
    far = band & (away > BAND * tile_side / 2)
    inside, outside = features[far & own], features[far & ~own]
    if min(len(inside), len(outside)) < FEW:
        return own.astype(float)
    axis = inside.mean(0) - outside.mean(0)
    share = (features - outside.mean(0)) @ axis / max(float(axis @ axis), 1e-12)
    # not cut at 0 and 1: texture averages out
    return np.where(band & (np.abs(share - own)[far].mean() < 0.5), share, own)
