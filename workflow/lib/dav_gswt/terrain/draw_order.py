"""Draw order of cells and tiles, back to front with little or no sorting, and the weights of levels of detail.

The viewer's `terrain/draw_order.js` computes the same order, and its shader (draw/shaders.js) the same weights;
tests/golden/draw_order.json and weights.json hold both to them.
"""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.terrain.choice import Floats, Ints, Vector

MAX_OPACITY = 1 - 1e-6  # an opaque Gaussian of weight 0 would otherwise be 0 * -infinity


def sort_cells(i: Ints, j: Ints, eye: tuple[int, int]) -> Ints:
    """Indices of cells from back to front, by their steps |i - i0| + |j - j0| from the eye's cell (i0, j0).

    A ray from the eye crosses cell edges only away from it, in i and in j, so each crossed edge adds a step: a cell
    with more steps never hides one with fewer, and cells of equal steps never hide each other. This is exact for
    everything that stays in the column of its cell. Equal steps are ordered by j, then by i.
    """
    return np.lexsort((i, j, -np.abs(i - eye[0]) - np.abs(j - eye[1])))


def in_near_block(i: Ints, j: Ints, eye: tuple[int, int]) -> Bool[Array, "n"]:
    """Whether cells belong to the 3 x 3 block about the eye's cell, where no direction serves a whole tile.

    The block is convex and holds the eye, so nothing outside hides anything inside: it is drawn last.
    """
    return np.maximum(np.abs(i - eye[0]), np.abs(j - eye[1])) <= 1


def nearest_order(directions: Float[Array, "d 3"], orders: list[int], to: Vector, slope: Float[Array, "2"]) -> int:
    """Position in `orders` of the pre-sorted order whose direction is nearest to the viewing direction.

    Orders were sorted on level ground. On a surface with slopes s the depth along a direction d is
    d . (J p) = (J^T d) . p, so the angle to J^T d = (d_x + s_x d_z, d_y + s_y d_z, d_z) counts. Ties: the first.

    Args:   orders: of the tile, indices into `directions`. to: from the eye to the tile's centre. slope: there.
    """
    x, y, z = directions[orders].T
    return int(np.argmax(x * (to[0] + slope[0] * to[2]) + y * (to[1] + slope[1] * to[2]) + z * to[2]))


def finer_share(distance: Floats, switch: float, band: float, smooth: bool = False) -> Floats:
    """Share of the finer of two levels at a distance d from the eye: clip(1/2 - (d - switch) / (2 band), 0, 1).

    1 nearer than switch - band, 0 beyond switch + band; band = 0 is a step with 1/2 at the switch; an infinite switch
    is never reached. smooth: s^2 (3 - 2 s) of it, which has a continuous slope.
    Source: DAV-GSWT, Eq. (lod_blend); its "0 otherwise" would make near splats vanish.
    """
    if band > 0:
        with np.errstate(over="ignore"):
            share = np.clip(0.5 - (distance - switch) / (2 * band), 0.0, 1.0)
    else:
        share = np.where(distance < switch, 1.0, np.where(distance > switch, 0.0, 0.5))
    return share * share * (3 - 2 * share) if smooth else share


def level_weights(distance: Floats, switches: list[float], bands: list[float]) -> Float[Array, "levels n"]:
    """Weight of each level at a distance: the first takes its share, each next one its share of the rest.

    The last level takes the whole rest, so weights are never negative and sum to 1, also where bands overlap.
    switches, bands: of each level against the next, the last (infinite) included.
    """
    rest, weights = np.ones_like(distance), []
    for switch, band in zip(switches[:-1], bands[:-1], strict=True):
        share = finer_share(distance, switch, band)
        weights.append(rest * share)
        rest = rest * (1 - share)
    return np.stack([*weights, rest])


def crossfade_opacity(opacity: Floats, weight: Floats) -> Floats:
    """Opacity of a Gaussian drawn with a weight w: 1 - (1 - opacity)^w, exactly the opacity at 1 and 0 at 0.

    Transmittances multiply, so two equal Gaussians of weights w and 1 - w hide as much as one.
    """
    partial = -np.expm1(weight * np.log1p(-np.minimum(opacity, MAX_OPACITY)))
    return np.where(weight == 1, opacity, np.where(weight == 0, 0.0, partial))
