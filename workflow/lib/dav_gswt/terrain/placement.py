"""Placement of a cell's Gaussians: relative to the eye, on the surface, back to front, faded between levels."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.bundle.orders import sort_back_to_front
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.terrain import draw_order, weights
from dav_gswt.terrain.displacement import displace_means
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.object_placement import place_objects
from dav_gswt.terrain.scatter import Instances
from dav_gswt.terrain.visibility import GridCells, active_levels

KEPT = 4096  # cells, levels and materials whose kept Gaussians are remembered


def place_cell(
    terrain: EndlessTerrain, cell: GridCells, eye: Float[Array, "3"], things: Instances | None = None
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """The Gaussians of one cell relative to the eye, and the surface's slope at each (see `displaced_axes`).

    After those of the tiles come those of things, the objects that are drawn with the cell. Positions count from the
    eye, so float32 resolves a disc kilometres away. Opacities are cross-faded between levels by each Gaussian's own
    distance. Where two levels are active their pre-sorted orders are merged, so neither level covers the other.
    """
    (i,), (j,), (tile,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist()
    levels = np.flatnonzero(active_levels(terrain, cell)[:, 0]).tolist()
    parts = collect_tiles(terrain, cell, levels)
    corner = np.array([i * terrain.side, j * terrain.side, 0.0])
    field, level = order_gaussians(parts, cell_direction(terrain, i, j, tile, eye))
    if things is not None:
        placed = place_objects(terrain, things, (i, j), eye)
        field, level = concatenate_fields([field, placed.field]), np.concatenate([level, placed.level])
    return displace_and_fade(terrain, field, level, corner, eye)


def collect_tiles(terrain: EndlessTerrain, cell: GridCells, levels: list[int]) -> dict[int, GaussianField]:
    """The Gaussians of one cell's tiles by level: of several materials those that stay (see `classes`)."""
    (i,), (j,), (tile,), (bits,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist(), cell.materials.tolist()
    if terrain.classes is None or bits & (bits - 1) == 0:
        return {level: terrain.tiles[level, tile] for level in levels}
    materials = [m for m in range(terrain.classes.materials) if bits >> m & 1]
    fields = {
        (level, m): terrain.tiles[level, m * terrain.tiles_each + tile % terrain.tiles_each]
        for level in levels
        for m in materials
    }
    kept = _find_kept(terrain, (i, j), fields)
    return {level: concatenate_fields([fields[level, m][kept[level, m]] for m in materials]) for level in levels}


def _find_kept(
    terrain: EndlessTerrain, cell: tuple[int, int], fields: dict[tuple[int, int], GaussianField]
) -> dict[tuple[int, int], Int[Array, "k"]]:
    """Indices of the Gaussians of each level and material that stay in a cell of several; they are remembered."""
    known, classes = terrain.kept, terrain.classes
    assert classes is not None
    if len(known) > KEPT:
        known.clear()  # other threads hold what they have found
    found = {place: rows for place in fields if (rows := known.get((*cell, *place))) is not None}
    missing = [place for place in fields if place not in found]
    if missing:
        sizes = [len(fields[place]) for place in missing]
        means = np.concatenate([fields[place].means for place in missing])
        stays = classes.keep(*cell, means, np.repeat([material for _, material in missing], sizes))
        for place, part in zip(missing, np.split(stays, np.cumsum(sizes)[:-1]), strict=True):
            found[place] = known[(*cell, *place)] = np.flatnonzero(part)
    return found


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
    return displace_and_fade(terrain, *order_gaussians(parts, direction), corner, eye)


def order_gaussians(
    parts: dict[int, GaussianField], direction: Float[Array, "3"]
) -> tuple[GaussianField, Int[Array, "n"]]:
    """Gaussians of several levels from back to front along a direction, and the level of each."""
    level = np.repeat(list(parts), [len(part) for part in parts.values()])
    flat = concatenate_fields(list(parts.values()))
    sequence = sort_back_to_front(flat.means, direction)
    return flat[sequence], level[sequence]


def displace_and_fade(
    terrain: EndlessTerrain,
    field: GaussianField,
    level: Int[Array, "n"],
    corner: Float[Array, "3"],
    eye: Float[Array, "3"],
) -> tuple[GaussianField, Float[Array, "k 2"]]:
    """Gaussians on the surface relative to the eye, in their order, faded by the weights of their levels."""
    field, slope = displace_means(field, terrain.heights, corner, eye)
    distance = np.linalg.norm(field.means.astype(float), axis=1)
    shares = weights.level_weights(distance, terrain.switches, terrain.bands, terrain.smooth)
    weight = shares[level, np.arange(len(level))]
    active = weight > 0
    return fade_opacity(field[active], weight[active]), slope[active]


def cell_direction(terrain: EndlessTerrain, i: int, j: int, tile: int, eye: Float[Array, "3"]) -> Float[Array, "3"]:
    """Direction of the pre-sorted order that is used for the tile in cell (i, j)."""
    x, y = (i + 0.5) * terrain.side, (j + 0.5) * terrain.side
    height, slope = terrain.heights.at(np.array([x]), np.array([y]))
    to = np.array([x, y, height[0] + 0.5 * sum(terrain.z)]) - eye
    orders = terrain.tile_orders[tile]
    return terrain.directions[orders[draw_order.nearest_order(terrain.directions, orders, to, slope[0])]]


def fade_opacity(field: GaussianField, weight: Float[Array, "n"]) -> GaussianField:
    """Opacities under these weights; a Gaussian of weight 1 keeps its bits."""
    partial = weight < 1
    if not partial.any():
        return field
    opacity = 1 / (1 + np.exp(-field.opacity_logits[partial].astype(float)))
    left = np.maximum(weights.crossfade_opacity(opacity, weight[partial]), 1e-30)
    logits = field.opacity_logits.copy()
    logits[partial] = np.log(left) - np.log1p(-left)
    return replace(field, opacity_logits=logits)
