"""A height field as few triangles: a right-triangulated irregular network whose bound holds at every lattice point.

Each block (a tile) is a hierarchy of right triangles: a triangle is split at the middle of its hypotenuse. A vertex's
error is the most that any lattice point of the triangles which it would split is off them, or that of any vertex whose
split needs it. So triangles that are split where the error exceeds a tolerance fit together without cracks, across
blocks too, and all that are left are within the tolerance.

Source: W. Evans, D. Kirkpatrick, G. Townsend, Right-triangulated irregular networks, Algorithmica 30, 2001.
"""

import numpy as np
from jaxtyping import Float32, Int64
from numpy import ndarray as Array

Triangles = tuple[Int64[Array, "t 3"], Int64[Array, "t 3"]]  # rows and columns of their corners


def simplify_heights(
    heights: Float32[Array, "rows columns"], block: int, tolerance: float
) -> tuple[Int64[Array, "v 2"], Int64[Array, "t 3"]]:
    """Lattice points (row, column) that are kept, and triangles of them, counter-clockwise from above.

    heights: of whole blocks: rows and columns are multiples of `block`, a power of two, plus one.
    Raises: ValueError: they are not.
    """
    size = np.array(heights.shape) - 1
    if block < 2 or block & (block - 1) or (size % block).any() or not size.all():
        raise ValueError(f"a height field of {heights.shape} is not of blocks of {block}")
    errors = measure_errors(heights, block)
    rows, columns = _extract(errors > tolerance, block)
    flat, triangles = np.unique(rows * heights.shape[1] + columns, return_inverse=True)
    points = np.stack(np.divmod(flat, heights.shape[1]), 1)
    return points, triangles.reshape(-1, 3)


def measure_errors(heights: Float32[Array, "rows columns"], block: int) -> Float32[Array, "rows columns"]:
    """The error of every lattice point; 0 at the corners of blocks."""
    errors = np.zeros(heights.shape, np.float32)
    for row in range(0, len(heights) - 1, block):  # a row of blocks at a time: memory stays bounded
        strip = heights[row : row + block + 1].astype(float)
        size = block
        while size > 1:
            _measure_squares(strip, size, errors[row : row + block + 1])
            size //= 2
    size = 2
    while size <= block:
        _raise_parents(errors, size, block)
        size *= 2
    return errors


def _measure_squares(strip: Array, size: int, errors: Array) -> None:
    """Most deviation from the triangles of squares of a size: cut by one diagonal, and by both."""
    points = np.lib.stride_tricks.sliding_window_view(strip, (size + 1, size + 1))[
        ::size, ::size
    ]  # [row, column, y, x]
    _measure_halves(points, errors)
    _measure_quarters(points, errors)


def _measure_halves(points: Array, errors: Array) -> None:
    """Of squares cut by the diagonal that goes through the middle of the square twice as large."""
    size = points.shape[-1] - 1
    south_west, south_east, north_west, north_east = _corners(points)
    t, s = np.mgrid[: size + 1, : size + 1] / size  # north, east
    rising = np.where(
        s >= t,
        south_west + s * (south_east - south_west) + t * (north_east - south_east),
        south_west + t * (north_west - south_west) + s * (north_east - north_west),
    )
    falling = np.where(
        s + t <= 1,
        south_west + s * (south_east - south_west) + t * (north_west - south_west),
        north_east + (1 - s) * (north_west - north_east) + (1 - t) * (south_east - north_east),
    )
    even = (np.add.outer(*map(np.arange, points.shape[:2])) % 2 == 0)[..., None, None]
    off = np.abs(points - np.where(even, rising, falling)).max((2, 3))
    errors[size // 2 :: size, size // 2 :: size] = off


def _measure_quarters(points: Array, errors: Array) -> None:
    """Of squares cut by both diagonals."""
    size = points.shape[-1] - 1
    half = size // 2
    south_west, south_east, north_west, north_east = _corners(points)
    v, u = np.mgrid[: size + 1, : size + 1] / half - 1  # north, east, from the middle
    middle = points[:, :, half, half][..., None, None]
    quarters = (  # the middle of the side in half sizes, the way to it, the way along it, the side's ends
        (0, 1, -v, u, south_west, south_east),
        (2, 1, v, u, north_west, north_east),
        (1, 0, -u, v, south_west, north_west),
        (1, 2, u, v, south_east, north_east),
    )
    for row, column, ahead, along, left, right in quarters:
        plane = middle + ahead * (0.5 * (left + right) - middle) + along * 0.5 * (right - left)
        off = np.where(ahead >= np.abs(along), np.abs(points - plane), 0).max((2, 3))
        target = errors[row * half :: size, column * half :: size][: off.shape[0], : off.shape[1]]
        np.maximum(target, off, out=target)


def _corners(points: Array) -> list[Array]:
    """South-west, south-east, north-west and north-east of squares."""
    return [points[:, :, a, b][..., None, None] for a in (0, -1) for b in (0, -1)]


def _raise_parents(errors: Array, size: int, block: int) -> None:
    """Give the errors of points that split squares of a size to those whose splits they need."""
    half = size // 2
    middles = errors[half::size, half::size]
    for rows, columns in ((0, half), (size, half), (half, 0), (half, size)):  # the middles of the four sides
        sides = errors[rows::size, columns::size][: middles.shape[0], : middles.shape[1]]
        np.maximum(middles, sides, out=middles)
    if size == block:
        return
    rows, columns = (np.arange(n) for n in middles.shape)
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):  # the corners that are off the square's diagonal
        corners = errors[row * size :: size, column * size :: size][: len(rows), : len(columns)]
        odd = (rows[:, None] + row + columns + column) % 2 == 1
        np.maximum(corners, np.where(odd, middles, 0), out=corners)


def _extract(split: Array, block: int) -> Triangles:
    """Rows and columns of the corners of all triangles that are left."""
    first = np.stack(np.meshgrid(*(np.arange(0, n - 1, block) for n in split.shape), indexing="ij"), -1).reshape(
        -1, 1, 2
    )
    south_east = first + np.array([[0, 0], [block, block], [0, block]])  # ends of the hypotenuse, right angle
    north_west = first + np.array([[block, block], [0, 0], [block, 0]])
    open_ones, left = np.concatenate([south_east, north_west]), []
    size = block
    while size > 1:
        for _ in range(2):
            middle = (open_ones[:, 0] + open_ones[:, 1]) // 2
            cut = split[middle[:, 0], middle[:, 1]]
            left.append(open_ones[~cut])
            (a, b, c), m = open_ones[cut].transpose(1, 0, 2), middle[cut]
            open_ones = np.concatenate([np.stack([c, a, m], 1), np.stack([b, c, m], 1)])
        size //= 2
    corners = np.concatenate([*left, open_ones])[:, [0, 2, 1]]  # counter-clockwise from above
    return corners[..., 0], corners[..., 1]
