"""Planets: the cells of a sphere that a camera may see, their draw order, and their Gaussians relative to the eye.

The viewer's `terrain/sphere_cells.js` does the same.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain import draw_order
from dav_gswt.terrain.backdrop import find_reach
from dav_gswt.terrain.choice import Floats, Ints, Vector
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import QUARTER, Sphere
from dav_gswt.terrain.placement import fade_levels, order_gaussians
from dav_gswt.terrain.sphere import FACES, FaceCells, bend, directions, find_kept, is_covered, is_frayed, tiles_on
from dav_gswt.terrain.visibility import GridCells, active_levels, frustum_planes


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
