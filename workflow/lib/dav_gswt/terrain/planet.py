"""Planets: six faces of n x n cells each, the cells that a camera may see, and their Gaussians relative to the eye.

A face is a square of angles: the point (a, b) of a face, in cells from its south-western corner, lies in the direction
tan(alpha) east + tan(beta) north + out with alpha = (a / n - 1/2) 90 degrees, and beta likewise. The faces are an
unfolded cube. Tiles go on across six of its edges. Across the other six, where faces meet turned by 90 degrees, the
tilings of both faces reach over the edge, and a noise that both share decides to which face a place belongs.

docs/formats.md has the formulas. The viewer's `terrain/sphere.js`, `sphere_edges.js` and `sphere_cells.js` compute the
same; tests/golden/sphere.json holds both to them.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, Rows
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain import draw_order
from dav_gswt.terrain.backdrop import find_reach
from dav_gswt.terrain.choice import Floats, Ints, Vector, tiles_at
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import QUARTER, SHIFT, Sphere, gradient_noise
from dav_gswt.terrain.placement import fade_levels, order_gaussians
from dav_gswt.terrain.visibility import GridCells, active_levels, frustum_planes

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
FRAY = 120  # axis of the hash of edge 0; edge k, that of the face it leads out of, uses FRAY + 2 k and the next
FINE = (3.0, 9.0)  # cells of the two octaves of the noise, on a tile's side
WIDTH, CONTRAST = 0.3, 2.5  # tile sides: most that an edge is moved; the noise is this many times as strong, and cut
TAPER = 0.5  # of the distance from a corner, in tile sides: there three faces meet, and edges are not moved
LEVEL, LIFT, HIGHEST = 0.03, 2.0, 0.2  # what is higher than LEVEL reaches over by LIFT times that, HIGHEST at most


@dataclass(frozen=True)
class FaceCells(Rows):
    """Cells of faces, or squares of cells of one size by their south-western cells."""

    face: Ints
    i: Ints
    j: Ints


def directions(face: Ints, tangents: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
    """Unit vectors to points of faces, from the planet's middle."""
    ray = np.concatenate([tangents, np.ones_like(tangents[:, :1])], 1)
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    return np.einsum("nk,nkc->nc", ray, FACES[face].astype(ray.dtype))


def bend(
    local: Float[Array, "n 3"], tangents: Float[Array, "*n 2"], radius: float, rate: float
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
    """Where points of a tile go on the sphere, and the derivative of that, both in the face's axes.

    local: from the middle of the tile, z above the ground. tangents: of the tile's middle. The points are returned from
    the place of the tile's middle on the ground. With t the tangents and d their change, |t + d| - |t| and the change
    of the direction are computed from d alone, so a shader's float32 keeps seven digits of a point's distance from
    the middle of its tile at any radius.
    """
    along = np.tan(local[:, :2] * rate)
    change = (1 + tangents * tangents) * along / (1 - tangents * along)
    there = tangents + change
    first, length = np.sqrt(1 + (tangents * tangents).sum(-1)), np.sqrt(1 + (there * there).sum(-1))
    longer = (change * (2 * tangents + change)).sum(-1) / (length + first)
    up = np.concatenate([there, np.ones_like(there[:, :1])], 1) / length[:, None]
    flat = np.concatenate([tangents * np.ones_like(there), np.ones_like(there[:, :1])], 1)
    shift = np.concatenate([change, np.zeros_like(there[:, :1])], 1) - flat * (longer / first)[..., None]
    points = radius * shift / length[:, None] + local[:, 2:] * up
    grow = (radius * rate + rate * local[:, 2:]) * (1 + there * there) / length[:, None]
    level = np.eye(3)[:, :2] - up[:, :, None] * up[:, None, :2]
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


def tiles_on(sphere: Sphere, cells: FaceCells, salt: int, variants: int) -> Ints:
    """Tile numbers of cells of faces: `choice.tiles_at` on the unfolded cube, which repeats after three faces' sides.

    Cells beyond an edge of a face belong to its tiling too.
    """
    n, face = sphere.cells, cells.face
    return tiles_at((face + 1) // 2 * n + cells.i, face // 2 * n + cells.j, salt, variants, 3 * n)


def is_covered(sphere: Sphere, cells: FaceCells) -> Bool[Array, "n"]:
    """Whether cells are of a face, or beyond one of its turned edges by one and not at a corner."""
    n, odd, i, j = sphere.cells, cells.face % 2 == 1, cells.i, cells.j
    inside_i, inside_j = (i >= 0) & (i < n), (j >= 0) & (j < n)
    return (inside_i & (inside_j | (j == np.where(odd, -1, n)))) | (inside_j & (i == np.where(odd, n, -1)))


def is_frayed(sphere: Sphere, cells: FaceCells) -> Bool[Array, "n"]:
    """Whether cells lie at a turned edge of their face, or beyond it."""
    n, odd, i, j = sphere.cells, cells.face % 2 == 1, cells.i, cells.j
    return np.where(odd, (i >= n - 1) | (j <= 0), (i <= 0) | (j >= n - 1))


def find_kept(sphere: Sphere, face: int, places: Float[Array, "n 3"], salt: int) -> Bool[Array, "n"]:
    """Which Gaussians of a face's tiling stay. places: in cells from the face's south-western corner; z in tile sides.

    With J the movement of an edge, Gaussians of the face that it leads out of stay up to J beyond it, and Gaussians of
    the other face where these do not. What rises above the ground reaches over, so things are not cut through.
    """
    half = 0.5 * sphere.cells
    u, v = places[:, 0] - half, places[:, 1] - half
    over = np.minimum(LIFT * np.maximum(np.abs(places[:, 2]) - LEVEL, 0), HIGHEST)
    across, along = (u, v) if face % 2 else (v, u)
    out = across - half <= _move_edge(sphere, face, along, across, salt) + over
    across, along = (-v, u) if face % 2 else (-u, v)
    moved = _move_edge(sphere, (face + 4) % 6, -along, across, salt, -1)
    return out & (across - half < over - moved)


def _move_edge(sphere: Sphere, edge: int, along: Floats, across: Floats, salt: int, sign: int = 1) -> Floats:
    """How far an edge is moved at places of a face, to be added to it on the side that the edge leads out of.

    along, across: cells from the face's middle, along the edge as it runs on that side. sign: -1 on the other side.
    """
    per_cell, half = QUARTER / sphere.cells, 0.5 * sphere.cells
    tangent = np.tan(across * per_cell)
    middle = np.arctan(np.tan(along * per_cell) * np.sqrt(2 / (1 + tangent * tangent))) / per_cell
    beyond = sign * (across - half)
    first, second = (
        gradient_noise(middle * fine + k * SHIFT[0], beyond * fine + k * SHIFT[1], FRAY + 2 * edge + k, salt)[0]
        for k, fine in enumerate(FINE)
    )
    most = np.clip(TAPER * (half - np.abs(middle)), 0, WIDTH)
    return most * np.clip(CONTRAST * (first + 0.5 * second), -1, 1)


def visible_on_sphere(terrain: EndlessTerrain, sphere: Sphere, camera: Camera) -> GridCells:
    """The cells within reach of the eye that a pinhole camera may see, back to front; i is a `Sphere.column`.

    Each face is halved again and again, and a square is culled with all of its cells where its bounding ball lies
    outside one plane of the frustum, out of reach, or below the horizon.
    """
    size = 1 << (sphere.cells + 1).bit_length()  # the next power of two
    squares = FaceCells(np.arange(6), np.full(6, -1), np.full(6, -1))
    while True:
        seen, nearest, farthest = _find_seen(terrain, sphere, camera, squares, size)
        squares = squares[seen]
        if size == 1:
            break
        size //= 2
        squares = FaceCells(
            np.repeat(squares.face, 4),
            (squares.i[:, None] + [0, size, 0, size]).ravel(),
            (squares.j[:, None] + [0, 0, size, size]).ravel(),
        )
        squares = squares[(squares.i <= sphere.cells) & (squares.j <= sphere.cells)]
    covered = np.flatnonzero(is_covered(sphere, squares))
    sequence, close = sort_on_sphere(sphere, squares[covered], camera.centre)
    order = covered[sequence]
    cells, nearest, farthest = squares[order], nearest[seen][order], farthest[seen][order]
    tile = tiles_on(sphere, cells, terrain.salt, terrain.variants)
    column, materials = sphere.column(cells.face, cells.i), np.ones(len(tile), np.int64)
    return GridCells(column, cells.j, tile, materials, close[sequence], nearest, farthest)


def _find_seen(
    terrain: EndlessTerrain, sphere: Sphere, camera: Camera, squares: FaceCells, size: int
) -> tuple[Bool[Array, "n"], Floats, Floats]:
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
    planes = frustum_planes(camera, terrain.near)
    most = (ball + terrain.overhang)[:, None] * np.linalg.norm(planes[:, :3], axis=1)
    seen &= (away @ planes[:, :3].T + most + planes[:, 3] >= 0).all(1)
    return seen, nearest, farthest


def _angle(chord: Floats) -> Floats:
    return 2 * np.arcsin(np.minimum(0.5 * chord, 1))


def sort_on_sphere(sphere: Sphere, cells: FaceCells, eye: Vector) -> tuple[Ints, Bool[Array, "n"]]:
    """Indices of cells from back to front, and which are in the block about the eye that is sorted by depth.

    All planes between columns, rows and faces pass through the planet's middle, and a ray crosses each once. So a face
    whose middle is farther from the eye never hides another, and on a face a cell with more steps from the eye's own
    never hides one with fewer, as in the plane; behind a face it is the other way round.
    """
    face, i, j = cells.face, cells.i, cells.j
    along = FACES @ eye
    sign = np.where(along[:, 2] < 0, -1, 1)
    own = (np.arctan2(along[:, :2] * sign[:, None], np.abs(along[:, 2:])) / QUARTER + 0.5) * sphere.cells
    own = np.floor(own).astype(np.int64)
    di, dj = np.abs(i - own[face, 0]), np.abs(j - own[face, 1])
    place = np.argsort(np.argsort(along[:, 2], kind="stable"), kind="stable")[face]
    return np.lexsort((i, j, -sign[face] * (di + dj), place)), (np.maximum(di, dj) <= 1) & (sign[face] > 0)


def place_on_sphere(
    terrain: EndlessTerrain, sphere: Sphere, cell: GridCells, eye: Vector
) -> tuple[GaussianField, Float[Array, "n 3 3"]]:
    """The Gaussians of one cell relative to the eye, and the derivative J of the sphere at each; as
    `placement.place_cell`.
    """
    (column,), (j,), (tile,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist()
    face, i = column // (sphere.cells + 2), column % (sphere.cells + 2) - 1
    levels = np.flatnonzero(active_levels(terrain, cell)[:, 0]).tolist()
    parts = {level: terrain.tiles[level, tile] for level in levels}
    if is_frayed(sphere, FaceCells(*(np.array([v]) for v in (face, i, j))))[0]:
        for level, field in parts.items():
            places = field.means.astype(float) / terrain.side + [i, j, 0]
            parts[level] = field[find_kept(sphere, face, places, terrain.salt)]
    tangents = sphere.tangents(np.array(i + 0.5), np.array(j + 0.5))
    axes, up = FACES[face].T.astype(float), np.array([*tangents, 1.0])
    up /= np.linalg.norm(up)
    centre = sphere.radius * axes @ up - eye
    _, jacobian = bend(np.array([[0.0, 0.0, 0.5 * sum(terrain.z)]]), tangents, sphere.radius, sphere.rate)
    to = jacobian[0].T @ (axes.T @ centre + 0.5 * sum(terrain.z) * up)
    orders = terrain.tile_orders[tile]
    nearest = draw_order.nearest_order(terrain.directions, orders, to, np.zeros(2))
    field, level = order_gaussians(parts, terrain.directions[orders[nearest]])
    local = field.means.astype(float) - [0.5 * terrain.side, 0.5 * terrain.side, 0]
    points, jacobians = bend(local, tangents, sphere.radius, sphere.rate)
    means = centre + points @ axes.T
    placed, active = fade_levels(terrain, field, level, np.linalg.norm(means, axis=1))
    return replace(placed, means=means[active].astype(np.float32)), axes @ jacobians[active]
