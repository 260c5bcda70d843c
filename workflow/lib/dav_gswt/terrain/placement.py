"""Placement of a cell's Gaussians: relative to the eye, on the surface, back to front, faded between levels."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.orders import sort_back_to_front
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.terrain import draw_order, weights
from dav_gswt.terrain.displacement import displace_means
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.visibility import GridCells, active_levels


def place_cell(
    terrain: EndlessTerrain, cell: GridCells, eye: Float[Array, "3"]
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """The Gaussians of one cell relative to the eye, and the surface's slope at each (see `displaced_axes`).

    Positions count from the eye, so float32 resolves a disc kilometres away. Opacities are cross-faded between levels
    by each Gaussian's own distance. Where two levels are active their pre-sorted orders are merged, so neither level
    covers the other.
    """
    (i,), (j,), (tile,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist()
    parts = {level: terrain.tiles[level, tile] for level in np.flatnonzero(active_levels(terrain, cell)[:, 0]).tolist()}
    corner = np.array([i * terrain.side, j * terrain.side, 0.0])
    return place_gaussians(terrain, parts, corner, cell_direction(terrain, i, j, tile, eye), eye)


def place_gaussians(
    terrain: EndlessTerrain,
    parts: dict[int, GaussianField],
    corner: Float[Array, "3"],
    direction: Float[Array, "3"],
    eye: Float[Array, "3"],
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """`place_cell` of any Gaussians.

    Args:   parts: Gaussians by level. corner: world position of their origin. direction: of the pre-sorted order.
    """
    level, flat = (
        np.repeat(list(parts), [len(part) for part in parts.values()]),
        concatenate_fields(list(parts.values())),
    )
    sequence = sort_back_to_front(flat.means, direction)
    field, slope = displace_means(flat[sequence], terrain.heights, corner, eye)
    level, distance = level[sequence], np.linalg.norm(field.means.astype(float), axis=1)
    shares = weights.level_weights(distance, terrain.switches, terrain.bands, terrain.smooth)
    weight = shares[level, np.arange(len(level))]
    active = weight > 0
    return _fade(field[active], weight[active]), slope[active]


def cell_direction(terrain: EndlessTerrain, i: int, j: int, tile: int, eye: Float[Array, "3"]) -> Float[Array, "3"]:
    """Direction of the pre-sorted order that is used for the tile in cell (i, j)."""
    x, y = (i + 0.5) * terrain.side, (j + 0.5) * terrain.side
    height, slope = terrain.heights.at(np.array([x]), np.array([y]))
    to = np.array([x, y, height[0] + 0.5 * sum(terrain.z)]) - eye
    orders = terrain.tile_orders[tile]
    return terrain.directions[orders[draw_order.nearest_order(terrain.directions, orders, to, slope[0])]]


def _fade(field: GaussianField, weight: Float[Array, "n"]) -> GaussianField:
    """Opacities under these weights; a Gaussian of weight 1 keeps its bits."""
    partial = weight < 1
    if not partial.any():
        return field
    opacity = 1 / (1 + np.exp(-field.opacity_logits[partial].astype(float)))
    left = np.maximum(weights.crossfade_opacity(opacity, weight[partial]), 1e-30)
    logits = field.opacity_logits.copy()
    logits[partial] = np.log(left) - np.log1p(-left)
    return replace(field, opacity_logits=logits)
