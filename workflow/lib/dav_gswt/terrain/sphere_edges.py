"""Tiles on the faces of a sphere, and the frayed edges where two faces meet turned.

Across the edges where tiles go on (see `sphere`) the choice is that of the plane, on the unfolded cube. Where faces
meet turned, the strips of their tiles cannot match. There both faces' tilings reach over the edge, and a noise that
both share says to which of them a place belongs: the edge frays as the border of two materials does.

The viewer's `terrain/sphere_edges.js` computes the same; tests/golden/sphere.json holds both to it.
"""

import numpy as np
from jaxtyping import Bool, Float, Int64
from numpy import ndarray as Array

from dav_gswt.terrain.choice import tiles_at
from dav_gswt.terrain.heights import gradient_noise
from dav_gswt.terrain.sphere import QUARTER, Sphere

FRAY = 120  # axis of the hash of edge 0; edge k, that of the face it leads out of, uses FRAY + 2 k and the next
FINE = (3.0, 9.0)  # cells of the two octaves of the noise, on a tile's side
SHIFT = (0.37, 0.71)  # of the second octave
WIDTH, CONTRAST = 0.3, 2.5  # tile sides: most that an edge is moved; the noise is this many times as strong, and cut
TAPER = 0.5  # of the distance from a corner, in tile sides: there three faces meet, and edges are not moved
LEVEL, LIFT, HIGHEST = 0.03, 2.0, 0.2  # what is higher than LEVEL reaches over by LIFT times that, HIGHEST at most


def tiles_on(
    sphere: Sphere, face: Int64[Array, "n"], i: Int64[Array, "n"], j: Int64[Array, "n"], salt: int, variants: int
) -> Int64[Array, "n"]:
    """Tile numbers of cells of faces: `choice.tiles_at` on the unfolded cube, which repeats after three faces' sides.

    Cells beyond an edge of a face belong to its tiling too.
    """
    n = sphere.cells
    return tiles_at((face + 1) // 2 * n + i, face // 2 * n + j, salt, variants, 3 * n)


def is_covered(sphere: Sphere, face: Int64[Array, "n"], i: Int64[Array, "n"], j: Int64[Array, "n"]) -> Bool[Array, "n"]:
    """Whether cells are of a face, or beyond one of its turned edges by one and not at a corner."""
    n, odd = sphere.cells, face % 2 == 1
    inside_i, inside_j = (i >= 0) & (i < n), (j >= 0) & (j < n)
    return (inside_i & (inside_j | (j == np.where(odd, -1, n)))) | (inside_j & (i == np.where(odd, n, -1)))


def is_frayed(sphere: Sphere, face: Int64[Array, "n"], i: Int64[Array, "n"], j: Int64[Array, "n"]) -> Bool[Array, "n"]:
    """Whether cells lie at a turned edge of their face, or beyond it."""
    n, odd = sphere.cells, face % 2 == 1
    return np.where(odd, (i >= n - 1) | (j <= 0), (i <= 0) | (j >= n - 1))


def find_kept(sphere: Sphere, face: int, places: Float[Array, "n 3"], salt: int) -> Bool[Array, "n"]:
    """Which Gaussians of a face's tiling stay. places: in cells from the face's south-western corner; z in tile sides.

    With J the movement of an edge, those of the face that it leads out of stay up to J beyond it, those of the other
    where these do not. What rises above the ground reaches over, so things are not cut through.
    """
    half = 0.5 * sphere.cells
    u, v = places[:, 0] - half, places[:, 1] - half
    over = np.minimum(LIFT * np.maximum(np.abs(places[:, 2]) - LEVEL, 0), HIGHEST)
    across, along = (u, v) if face % 2 else (v, u)
    out = across - half <= _move_edge(sphere, face, along, across, salt) + over
    across, along = (-v, u) if face % 2 else (-u, v)
    moved = _move_edge(sphere, (face + 4) % 6, -along, across, salt, -1)
    return out & (across - half < over - moved)


def _move_edge(
    sphere: Sphere, edge: int, along: Float[Array, "n"], across: Float[Array, "n"], salt: int, sign: int = 1
) -> Float[Array, "n"]:
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
