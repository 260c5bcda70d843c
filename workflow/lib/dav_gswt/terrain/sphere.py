"""The sphere: a planet of tiles, six faces of n x n cells each, and how the plane of a tile bends onto it.

A face is a square of angles: the point (a, b) of a face, in cells from its south-western corner, lies in the direction
tan(alpha) east + tan(beta) north + out with alpha = (a / n - 1/2) 90 degrees, and beta likewise. Cells along a face's
middle are equally wide, and all planes between columns pass through the planet's middle, also beyond the face's edges:
the columns of two faces that share an edge are the same pencil of planes.

The six faces are an unfolded cube, a staircase: the east of an even face is the west of the next, the north of an odd
face the south of the next, and after the sixth comes the first. Across these six edges tiles go on as in the plane. The
other six join the north of an even face to the west of the next but one, and the east of an odd face to the south of
the next but one, turned by 90 degrees: fewer than six turned edges are impossible, since at each of the eight corners
three right angles meet, a quarter turn short of the plane's four, and a connected set of edges can only make up for a
whole number of turns.

The viewer's `terrain/sphere.js` computes the same numbers; tests/golden/sphere.json holds both to them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64
from numpy import ndarray as Array

from dav_gswt.errors import InputError

FACES = np.array(  # east, north and out of each face
    [
        [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        [[-1, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[-1, 0, 0], [0, -1, 0], [0, 0, 1]],
        [[0, 0, -1], [0, -1, 0], [-1, 0, 0]],
        [[0, 0, -1], [1, 0, 0], [0, -1, 0]],
        [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
    ]
)
QUARTER = 0.5 * np.pi
WEST, NORTH, EAST, SOUTH = range(4)


@dataclass(frozen=True)
class Sphere:
    """A sphere as the surface of a terrain, about the world's origin: a height field that is 0 above it.

    radius: of the ground, in world units. side: of a tile. cells: along the side of a face.
    """

    radius: float
    side: float
    cells: int
    low: float = 0.0
    high: float = 0.0
    steepest: float = 0.0

    @property
    def rate(self) -> float:
        """Angle of a world unit on a tile."""
        return QUARTER / (self.cells * self.side)

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        return np.zeros(len(x)), np.zeros((len(x), 2))

    def column(self, face: Int64[Array, "*n"], i: Int64[Array, "*n"]) -> Int64[Array, "*n"]:
        """The columns of all faces beside each other, each with one more beyond its western and its eastern edge."""
        return face * (self.cells + 2) + i + 1

    def split_column(self, column: Int64[Array, "n"]) -> tuple[Int64[Array, "n"], Int64[Array, "n"]]:
        """Face and column in it; see `column`."""
        face, rest = np.divmod(column, self.cells + 2)
        return face, rest - 1

    def tangents(self, a: Float[Array, "*n"], b: Float[Array, "*n"]) -> Float[Array, "*n 2"]:
        """Tangents of the two angles of points of a face, in cells from its south-western corner."""
        return np.tan((np.stack([a, b], -1) / self.cells - 0.5) * QUARTER)


def make_sphere(radius: float, side: float) -> Sphere:
    """A sphere with as many cells as make their mean area that of a tile. radius: in tile sides."""
    return Sphere(radius * side, side, max(1, round(radius * np.sqrt(2 * np.pi / 3))))


def require_plain_cover(kind: str, classes: object, objects: Sequence[object] | None) -> None:
    """Refuse several materials, and objects, on a surface of the kind `sphere`. Raises: InputError."""
    if kind == "sphere" and (classes or objects):
        what = "several materials" if classes else "objects"
        raise InputError(
            f"heights: a sphere is covered with one material and no objects, and this scene has {what}: "
            "give the scene `materials: one`, or choose another surface"
        )


def directions(face: Int64[Array, "n"], tangents: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
    """Unit vectors to points of faces, from the planet's middle."""
    ray = np.concatenate([tangents, np.ones_like(tangents[:, :1])], 1)
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    return np.einsum("nk,nkc->nc", ray, FACES[face].astype(ray.dtype))


def locate(sphere: Sphere, points: Float[Array, "n 3"]) -> tuple[Int64[Array, "n"], Float[Array, "n 2"]]:
    """The face under points, and the places on it in cells from its south-western corner."""
    face = np.argmax(points @ FACES[:, 2].T, axis=1).astype(np.int64)
    along = np.einsum("nc,nkc->nk", points, FACES[face])
    return face, (np.arctan2(along[:, :2], along[:, 2:]) / QUARTER + 0.5) * sphere.cells


def cross_edge(face: int, side: int) -> tuple[int, int, int]:
    """What lies beyond an edge of a face: the face, its side there, and the quarter turns to the left from the one
    face's east to the other's (0: tiles go on).
    """
    odd = face % 2
    if side == (NORTH if odd else EAST):
        return (face + 1) % 6, SOUTH if odd else WEST, 0
    if side == (WEST if odd else SOUTH):
        return (face + 5) % 6, EAST if odd else NORTH, 0
    if side == (EAST if odd else NORTH):
        return (face + 2) % 6, SOUTH if odd else WEST, 3 if odd else 1
    return (face + 4) % 6, EAST if odd else NORTH, 1 if odd else 3


def step_cell(sphere: Sphere, face: int, i: int, j: int, side: int) -> tuple[int, int, int, int]:
    """The cell beyond a side of a cell: face, column, row, and the quarter turns as of `cross_edge`."""
    n = sphere.cells
    i, j = i + (side == EAST) - (side == WEST), j + (side == NORTH) - (side == SOUTH)
    if 0 <= i < n and 0 <= j < n:
        return face, i, j, 0
    there, entered, turns = cross_edge(face, side)
    along = j if side in (WEST, EAST) else i
    along = n - 1 - along if turns else along
    return there, *_edge_cell(entered, along, n), turns


def _edge_cell(side: int, along: int, n: int) -> tuple[int, int]:
    return {WEST: (0, along), EAST: (n - 1, along), SOUTH: (along, 0), NORTH: (along, n - 1)}[side]


def bend(
    local: Float[Array, "n 3"], tangents: Float[Array, "*n 2"], radius: float, rate: float
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
    """Where points of a tile go on the sphere, and the derivative of that, both in the face's axes.

    local: from the middle of the tile, z above the ground. tangents: of the tile's middle. The points are returned from
    the place of the tile's middle on the ground. With t the tangents and d their change, |t + d| - |t| and the change
    of the direction are computed from d alone, so float32 keeps seven digits of a point's distance from the middle of
    its tile at any radius.
    """
    along = np.tan(local[:, :2] * local.dtype.type(rate))
    change = (1 + tangents * tangents) * along / (1 - tangents * along)
    there = tangents + change
    first, length = np.sqrt(1 + (tangents * tangents).sum(-1)), np.sqrt(1 + (there * there).sum(-1))
    longer = (change * (2 * tangents + change)).sum(-1) / (length + first)
    up = np.concatenate([there, np.ones_like(there[:, :1])], 1) / length[:, None]
    flat = np.concatenate([tangents * np.ones_like(there), np.ones_like(there[:, :1])], 1)
    shift = np.concatenate([change, np.zeros_like(there[:, :1])], 1) - flat * (longer / first)[..., None]
    points = local.dtype.type(radius) * shift / length[:, None] + local[:, 2:] * up
    grow = (radius * rate + rate * local[:, 2:]).astype(local.dtype) * (1 + there * there) / length[:, None]
    level = np.eye(3, dtype=local.dtype)[:, :2] - up[:, :, None] * up[:, None, :2]
    return points, np.concatenate([level * grow[:, None], up[:, :, None]], 2)


def frame_at(longitude: float, latitude: float) -> Float[Array, "3 3"]:
    """East, north and up at a place, in degrees; at the poles those of the longitude."""
    east, north = np.radians([longitude, latitude])
    (s, c), (p, q) = (np.sin(east), np.cos(east)), (np.sin(north), np.cos(north))
    return np.array([[-s, c, 0.0], [-p * c, -p * s, q], [q * c, q * s, p]])


def walk_from(frame: Float[Array, "3 3"], way: Float[Array, "2"], radius: float) -> Float[Array, "3 3"]:
    """The frame of one who walked straight on, `way` to the east and the north, and looks as before."""
    angle = np.hypot(*way) / radius
    if angle == 0:
        return frame
    (east, north), up = way / np.hypot(*way), frame[2]
    ahead = east * frame[0] + north * frame[1]
    left = east * frame[1] - north * frame[0]
    ahead, up = np.cos(angle) * ahead - np.sin(angle) * up, np.cos(angle) * up + np.sin(angle) * ahead
    return np.stack([east * ahead - north * left, north * ahead + east * left, up])
