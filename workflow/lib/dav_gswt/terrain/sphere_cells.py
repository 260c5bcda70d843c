"""Cells of a sphere that a camera may see, and their draw order.

The viewer's `terrain/sphere_cells.js` does the same.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.sphere import FACES, QUARTER, Sphere, directions
from dav_gswt.terrain.sphere_edges import is_covered, tiles_on
from dav_gswt.terrain.visibility import GridCells, outside_by_ball

CLIMB = 3.0  # times the reach on the ground by which the reach grows with the eye's height, at most


@dataclass(frozen=True)
class _Squares:
    """Squares of cells of one size: their faces and south-western cells."""

    face: Int64[Array, "n"]
    i: Int64[Array, "n"]
    j: Int64[Array, "n"]

    def __getitem__(self, index) -> "_Squares":
        return _Squares(self.face[index], self.i[index], self.j[index])


def visible_on_sphere(terrain: EndlessTerrain, sphere: Sphere, camera: Camera) -> GridCells:
    """The cells within reach of the eye that a pinhole camera may see, back to front; i is a `Sphere.column`.

    Each face is halved again and again, and a square is culled with all of its cells where its bounding ball lies
    outside one plane of the frustum, out of reach, or below the horizon.
    """
    size, eye = 1, camera.centre
    while size < sphere.cells + 2:
        size *= 2
    squares = _Squares(np.arange(6), np.full(6, -1), np.full(6, -1))
    while True:
        seen, nearest, farthest = _find_seen(terrain, sphere, camera, squares, size)
        squares = squares[seen]
        if size == 1:
            break
        size //= 2
        squares = _Squares(
            np.repeat(squares.face, 4),
            (squares.i[:, None] + [0, size, 0, size]).ravel(),
            (squares.j[:, None] + [0, 0, size, size]).ravel(),
        )
        squares = squares[(squares.i <= sphere.cells) & (squares.j <= sphere.cells)]
    covered = is_covered(sphere, squares.face, squares.i, squares.j)
    squares, nearest, farthest = squares[covered], nearest[seen][covered], farthest[seen][covered]
    sequence, close = sort_on_sphere(sphere, squares.face, squares.i, squares.j, eye)
    squares = squares[sequence]
    tile = tiles_on(sphere, squares.face, squares.i, squares.j, terrain.salt, terrain.variants)
    column = sphere.column(squares.face, squares.i)
    return GridCells(
        column, squares.j, tile, np.ones(len(tile), np.int64), close[sequence], nearest[sequence], farthest[sequence]
    )


def find_reach(terrain: EndlessTerrain, sphere: Sphere, eye: Float[Array, "3"]) -> float:
    """Distance to the last tiles: longer from above, where more of the ground is in view."""
    reach = terrain.reach * terrain.side
    return reach + min(max(float(np.linalg.norm(eye)) - sphere.radius, 0.0), CLIMB * reach)


def _find_seen(
    terrain: EndlessTerrain, sphere: Sphere, camera: Camera, squares: _Squares, size: int
) -> tuple[Bool[Array, "n"], Float[Array, "n"], Float[Array, "n"]]:
    """Which squares may be seen, and bounds of the distances from the eye to the centres of their Gaussians."""
    n, eye, radius = sphere.cells, camera.centre, sphere.radius
    first = np.stack([squares.i, squares.j], 1).astype(float)
    last = np.minimum(first + size, n + 1)
    middle = directions(squares.face, sphere.tangents(*(0.5 * (first + last)).T))
    corners = [
        directions(squares.face, sphere.tangents(a, b))
        for a in (first[:, 0], last[:, 0])
        for b in (first[:, 1], last[:, 1])
    ]
    chord = np.max([np.linalg.norm(corner - middle, axis=1) for corner in corners], axis=0)
    low, high = terrain.z
    ball = radius * chord + max(abs(low), abs(high))
    away = radius * middle - eye
    distance = np.linalg.norm(away, axis=1)
    nearest, farthest = np.maximum(distance - ball, 0), distance + ball
    far = float(np.linalg.norm(eye))
    dip, rise = (np.arccos(np.clip((radius + low) / top, -1, 1)) for top in (far, radius + high))
    apart = _angle(np.linalg.norm(middle - eye / far, axis=1)) - _angle(chord) - terrain.overhang / radius
    seen = (nearest < find_reach(terrain, sphere, eye)) & (apart <= dip + rise)
    return seen & ~outside_by_ball(camera, terrain.near, away, ball + terrain.overhang), nearest, farthest


def _angle(chord: Float[Array, "n"]) -> Float[Array, "n"]:
    return 2 * np.arcsin(np.minimum(0.5 * chord, 1))


def sort_on_sphere(
    sphere: Sphere, face: Int64[Array, "n"], i: Int64[Array, "n"], j: Int64[Array, "n"], eye: Float[Array, "3"]
) -> tuple[Int64[Array, "n"], Bool[Array, "n"]]:
    """Indices of cells from back to front, and which are in the block about the eye that is sorted by depth.

    The planes between a face's columns and between its rows, and those between faces, pass through the planet's middle,
    and a ray crosses each once. So of two faces the one whose middle is farther from the eye never hides the other, and
    on a face a cell with more steps from the eye's own never hides one with fewer, as in the plane; behind a face it is
    the other way round.
    """
    along = FACES @ eye
    sign = np.where(along[:, 2] < 0, -1, 1)
    own = (np.arctan2(along[:, :2] * sign[:, None], np.abs(along[:, 2:])) / QUARTER + 0.5) * sphere.cells
    own = np.floor(own).astype(np.int64)
    di, dj = np.abs(i - own[face, 0]), np.abs(j - own[face, 1])
    place = np.argsort(np.argsort(along[:, 2], kind="stable"), kind="stable")[face]
    return np.lexsort((i, j, -sign[face] * (di + dj), place)), (np.maximum(di, dj) <= 1) & (sign[face] > 0)
