"""In which order things are drawn so that what is nearer covers what is farther, with little or no sorting.

The page computes the same order; tests/golden/draw_order.json holds both to it.
"""

import numpy as np
from jaxtyping import Bool, Float, Int, Int64
from numpy import ndarray as Array


def back_to_front(
    i: Int64[Array, "n"], j: Int64[Array, "n"], eye: tuple[int, int]
) -> tuple[Int[Array, "n"], Int64[Array, "n"]]:
    """Indices of cells from back to front, and each cell's steps |i - i0| + |j - j0| from the eye's cell (i0, j0).

    A ray from the eye crosses cell edges only away from it, in i and in j, so each edge that it crosses is a step more:
    a cell with more steps never hides one with fewer, and cells of equal steps hide nothing of each other. Exact for
    all that stays in its cell's column, whatever its height. Equal steps are drawn by j, then by i.
    """
    steps = np.abs(i - eye[0]) + np.abs(j - eye[1])
    return np.lexsort((i, j, -steps)), steps


def around(i: Int64[Array, "n"], j: Int64[Array, "n"], eye: tuple[int, int]) -> Bool[Array, "n"]:
    """The 3 x 3 cells about the eye's cell, where no one direction is the viewing direction of a whole tile.

    Their square is convex and holds the eye, so nothing outside it ever hides what is in it: it is drawn last.
    """
    return np.maximum(np.abs(i - eye[0]), np.abs(j - eye[1])) <= 1


def nearest(directions: Float[Array, "d 3"], kept: list[int], to: Float[Array, "3"], slope: Float[Array, "2"]) -> int:
    """Position in `kept` of the pre-sorted order that serves best: its direction is nearest to the viewing direction.

    Orders were sorted on level ground. On a surface with slopes s depth along a direction d is d . (J p) = (J^T d) . p:
    what counts is the angle to J^T d = (d_x + s_x d_z, d_y + s_y d_z, d_z). Of equals the first.

    Args:   to: from the eye to the tile's middle, of any length. slope: of the surface there.
    """
    x, y, z = directions[kept].T
    return int(np.argmax(x * (to[0] + slope[0] * to[2]) + y * (to[1] + slope[1] * to[2]) + z * to[2]))
