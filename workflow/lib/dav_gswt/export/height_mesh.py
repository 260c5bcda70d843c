"""A height field as few triangles: a right-triangulated irregular network whose bound holds at every lattice point.

Each block (a tile) is a hierarchy of right triangles: a triangle is split at the middle of its hypotenuse. The error of
such a middle is the greatest distance of a lattice point from the triangles that it would split, or the error of a
middle below it if that is greater. So triangles that are split where the error exceeds a tolerance fit together without
cracks, also across blocks, and all that remain are within the tolerance.

Source: W. Evans, D. Kirkpatrick, G. Townsend, Right-triangulated irregular networks, Algorithmica 30, 2001.
"""

from itertools import product

import numpy as np
from jaxtyping import Float32, Int64
from numpy import ndarray as Array

Triangles = Int64[Array, "t 3 2"]  # row and column of the ends of the hypotenuse and of the right angle


def simplify_heights(
    heights: Float32[Array, "rows columns"], block: int, tolerance: float
) -> tuple[Int64[Array, "v 2"], Int64[Array, "t 3"]]:
    """Lattice points (row, column) that are kept, and triangles of them, counter-clockwise from above.

    heights: of whole blocks: rows and columns are multiples of `block`, a power of two, plus one.
    """
    size = np.array(heights.shape) - 1
    split = measure_errors(heights, block) > tolerance
    first = np.array(list(product(*(range(0, n, block) for n in size))))[:, None]
    open_ones, kept = (_cut_block(block)[:, None] + first).reshape(-1, 3, 2), []
    for _ in range(_count_levels(block)):
        middle = _find_middles(open_ones)
        cut = split[middle[:, 0], middle[:, 1]]
        kept.append(open_ones[~cut])
        open_ones = _split_triangles(open_ones[cut])
    corners = np.concatenate([*kept, open_ones])[:, [0, 2, 1]]  # counter-clockwise from above
    flat, triangles = np.unique(corners @ [heights.shape[1], 1], return_inverse=True)
    return np.stack(np.divmod(flat, heights.shape[1]), 1), triangles.reshape(-1, 3)


def measure_errors(heights: Float32[Array, "rows columns"], block: int) -> Float32[Array, "rows columns"]:
    """The error of every lattice point; 0 at the corners of blocks."""
    errors = np.zeros(heights.shape, np.float32)
    levels = [_cut_block(block)]
    for _ in range(_count_levels(block)):
        levels.append(_split_triangles(levels[-1]))
    for triangles, finer in zip(levels[-2::-1], levels[:0:-1], strict=True):
        middle, below = _find_middles(triangles), _find_middles(finer)
        points, along, across = _list_points(triangles)
        for row, column in product(*(range(0, n - 1, block) for n in heights.shape)):
            patch = np.s_[row : row + block + 1, column : column + block + 1]
            z, here = heights[patch].astype(float), errors[patch]
            a, b, c = (z[tuple(triangles[:, k].T)][:, None] for k in range(3))
            off = np.abs(z[points[..., 0], points[..., 1]] - (c + along * (a - c) + across * (b - c))).max(1)
            if len(finer) < 2 * block**2:  # else these cannot be split
                off = np.maximum(off, here[below[:, 0], below[:, 1]].reshape(2, -1).max(0))
            np.maximum.at(here, (middle[:, 0], middle[:, 1]), off.astype(np.float32))
    return errors


def _count_levels(block: int) -> int:
    """How often the triangles of a block can be split."""
    return 2 * (block.bit_length() - 1)


def _cut_block(block: int) -> Triangles:
    """The two triangles of a block, south-east and north-west of its rising diagonal."""
    return np.array([[[0, 0], [block, block], [0, block]], [[block, block], [0, 0], [block, 0]]])


def _find_middles(triangles: Triangles) -> Int64[Array, "t 2"]:
    return (triangles[:, 0] + triangles[:, 1]) // 2


def _split_triangles(triangles: Triangles) -> Int64[Array, "halves 3 2"]:
    """The first half of each triangle, then the second half of each."""
    (a, b, c), middle = triangles.transpose(1, 0, 2), _find_middles(triangles)
    return np.concatenate([np.stack([c, a, middle], 1), np.stack([b, c, middle], 1)])


def _list_points(triangles: Triangles) -> tuple[Int64[Array, "t p 2"], Array, Array]:
    """The lattice points in triangles of one level, and how far along their two legs each lies, in [0, 1]."""
    a, b, c = triangles.transpose(1, 0, 2)[..., None, :]
    diagonal = bool((a - c)[0].all())
    steps = int(np.abs(a - c)[0].max()) * (2 if diagonal else 1)
    i, j = (v.ravel() for v in np.mgrid[: steps + 1, : steps + 1])
    inside = (i + j <= steps) & (((i + j) % 2 == 0) | (not diagonal))
    i, j = i[inside], j[inside]
    return c + (i[:, None] * (a - c) + j[:, None] * (b - c)) // steps, i / steps, j / steps
