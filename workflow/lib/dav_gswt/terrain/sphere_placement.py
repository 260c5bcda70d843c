"""Placement of a cell's Gaussians on a sphere: relative to the eye, back to front, faded between levels."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.terrain import draw_order, weights
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.placement import KEPT, fade_opacity, order_gaussians
from dav_gswt.terrain.sphere import FACES, Sphere, bend
from dav_gswt.terrain.sphere_edges import find_kept, is_frayed
from dav_gswt.terrain.visibility import GridCells, active_levels


def place_on_sphere(
    terrain: EndlessTerrain, sphere: Sphere, cell: GridCells, eye: Float[Array, "3"]
) -> tuple[GaussianField, Float[Array, "n 3 3"]]:
    """The Gaussians of one cell relative to the eye, and the derivative J of the sphere at each; as
    `placement.place_cell`.
    """
    (j,), (tile,) = cell.j.tolist(), cell.tile.tolist()
    face, i = (int(v[0]) for v in sphere.split_column(cell.i))
    levels = np.flatnonzero(active_levels(terrain, cell)[:, 0]).tolist()
    parts = {level: _keep(terrain, sphere, (face, i, j), level, tile) for level in levels}
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
    distance = np.linalg.norm(means, axis=1)
    shares = weights.level_weights(distance, terrain.switches, terrain.bands, terrain.smooth)
    weight = shares[level, np.arange(len(level))]
    active = weight > 0
    placed = replace(field, means=means.astype(np.float32))[active]
    return fade_opacity(placed, weight[active]), axes @ jacobians[active]


def _keep(terrain: EndlessTerrain, sphere: Sphere, cell: tuple[int, int, int], level: int, tile: int) -> GaussianField:
    """The Gaussians of a tile that stay in a cell; they are remembered where the face's edge frays."""
    field, (face, i, j) = terrain.tiles[level, tile], cell
    if not is_frayed(sphere, *(np.array([v]) for v in cell))[0]:
        return field
    key = (face * (sphere.cells + 2) + i + 1, j, level, tile)
    if len(terrain.kept) > KEPT:
        terrain.kept.clear()
    if key not in terrain.kept:
        places = field.means.astype(float) / terrain.side + [i, j, 0]
        terrain.kept[key] = np.flatnonzero(find_kept(sphere, face, places, terrain.salt))
    return field[terrain.kept[key]]
