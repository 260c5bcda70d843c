"""Draw order of cells and tiles: back to front, with little or no sorting.

The viewer's `terrain/draw_order.js` computes the same order; tests/golden/draw_order.json holds both to it.
"""

import numpy as np
from jaxtyping import Bool, Float, Int, Int64
from numpy import ndarray as Array


def sort_cells(
    i: Int64[Array, "n"], j: Int64[Array, "n"], eye: tuple[int, int]
) -> tuple[Int[Array, "n"], Int64[Array, "n"]]:
    """Indices of cells from back to front, and each cell's steps |i - i0| + |j - j0| from the eye's cell (i0, j0).

    A ray from the eye crosses cell edges only away from it, in i and in j, so each crossed edge adds a step: a cell
    with more steps never hides one with fewer, and cells of equal steps never hide each other. Exact for everything
    that stays in the column of its cell, whatever its height. Equal steps are ordered by j, then by i.
    """
    steps = np.abs(i - eye[0]) + np.abs(j - eye[1])
    return np.lexsort((i, j, -steps)), steps


def in_near_block(i: Int64[Array, "n"], j: Int64[Array, "n"], eye: tuple[int, int]) -> Bool[Array, "n"]:
    """Whether cells belong to the 3 x 3 block about the eye's cell, where no direction serves a whole tile.

    The block is convex and holds the eye, so nothing outside hides anything inside: it is drawn last.
    """
    return np.maximum(np.abs(i - eye[0]), np.abs(j - eye[1])) <= 1


def nearest_order(
    directions: Float[Array, "d 3"], orders: list[int], to: Float[Array, "3"], slope: Float[Array, "2"]
) -> int:
    """Position in `orders` of the pre-sorted order whose direction is nearest to the viewing direction.

    Orders were sorted on level ground. On a surface with slopes s the depth along a direction d is
    d . (J p) = (J^T d) . p, so the angle to J^T d = (d_x + s_x d_z, d_y + s_y d_z, d_z) counts. Ties: the first.

    Args:   orders: indices into `directions`, those that the tile keeps. to: from the eye to the tile's centre, of any
            length. slope: of the surface there.
    """
    x, y, z = directions[orders].T
    return int(np.argmax(x * (to[0] + slope[0] * to[2]) + y * (to[1] + slope[1] * to[2]) + z * to[2]))
