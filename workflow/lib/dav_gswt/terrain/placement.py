"""Placement of a cell's Gaussians, and of the objects on it: relative to the eye, on the surface, back to front, faded
between levels.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.bundle.orders import sort_back_to_front
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.materials.model import turn_and_scale, turn_rows
from dav_gswt.terrain.choice import Floats, Vector
from dav_gswt.terrain.draw_order import crossfade_opacity, level_weights, nearest_order
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import displace_means
from dav_gswt.terrain.light import shade_field
from dav_gswt.terrain.scatter import Instances
from dav_gswt.terrain.variation import tint_field
from dav_gswt.terrain.visibility import GridCells, active_levels, active_range

Part = tuple[GaussianField, Int[Array, "_"]]  # Gaussians, and the level of each


def place_cell(
    terrain: EndlessTerrain, cell: GridCells, eye: Vector, things: Instances | None = None
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """The Gaussians of one cell relative to the eye, and the surface's slope at each (see `displaced_axes`).

    Objects (`things`) that are drawn with the cell come after its tiles. Positions count from the eye, so float32
    resolves a disc kilometres away. Opacities are cross-faded between levels by each Gaussian's own distance. Where two
    levels are active their pre-sorted orders are merged, so neither level covers the other.
    """
    (i,), (j,), (tile,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist()
    levels = np.flatnonzero(active_levels(terrain, cell)[:, 0]).tolist()
    parts = [order_gaussians(collect_tiles(terrain, cell, levels), cell_direction(terrain, i, j, tile, eye))]
    if things is not None:
        parts.append(place_objects(terrain, things, (i, j), eye))
    corner = np.array([i * terrain.side, j * terrain.side, 0.0])
    field, level = concatenate_parts(parts)
    field, slope = displace_means(field, terrain.heights, corner, eye)
    faded, active = fade_levels(terrain, field, level, np.linalg.norm(field.means.astype(float), axis=1))
    return faded, slope[active]


def concatenate_parts(parts: list[Part]) -> Part:
    """The Gaussians of all parts, in their order, and the level of each."""
    return concatenate_fields([field for field, _ in parts]), np.concatenate([level for _, level in parts])


def collect_tiles(terrain: EndlessTerrain, cell: GridCells, levels: list[int]) -> dict[int, GaussianField]:
    """The Gaussians of one cell's tiles by level, with the colours of the place: of several materials those that stay
    (see `classes`).
    """
    (i,), (j,), (tile,), (bits,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist(), cell.materials.tolist()
    if terrain.classes is None or bits & (bits - 1) == 0:
        material = tile // terrain.tiles_each
        return {level: _colour_ground(terrain, terrain.tiles[level, tile], i, j, material) for level in levels}
    found, each = {}, terrain.tiles_each
    for level in levels:
        parts = {
            m: terrain.tiles[level, m * each + tile % each] for m in range(terrain.classes.materials) if bits >> m & 1
        }
        field = concatenate_fields(list(parts.values()))
        material = np.repeat(list(parts), [len(part) for part in parts.values()])
        kept = terrain.classes.keep(i, j, field.means, material)
        found[level] = _colour_ground(terrain, field[kept], i, j, material[kept])
    return found


def _colour_ground(
    terrain: EndlessTerrain, field: GaussianField, i: int, j: int, material: int | Int[Array, "n"]
) -> GaussianField:
    """Gaussians of a cell, positions from its corner, with the colours of their places."""
    if terrain.variation is None and terrain.light is None:
        return field
    x, y = (at * terrain.side + field.means[:, axis].astype(float) for axis, at in enumerate((i, j)))
    if terrain.variation is not None:
        field = tint_field(field, terrain.variation.at(x, y, material))
    return field if terrain.light is None else shade_field(field, terrain.light.ground_ratio(x, y))


def colour_objects(
    terrain: EndlessTerrain, field: GaussianField, found: Instances, row: Int[Array, "n"], corner: Sequence[float]
) -> GaussianField:
    """Gaussians of objects, varied as the ground at their feet and lit as the ground below them.

    row: the object of each. corner: world position that the field's positions count from.
    """
    if terrain.variation is not None:
        x, y = (found.i + found.u) * terrain.side, (found.j + found.v) * terrain.side
        material = np.array([each.material for each in terrain.object_entries])[found.number]
        field = tint_field(field, terrain.variation.at(x, y, material)[row])
    if terrain.light is None:
        return field
    x, y = (field.means[:, axis].astype(float) + corner[axis] for axis in (0, 1))
    return shade_field(field, terrain.light.ground_ratio(x, y))


def order_gaussians(parts: dict[int, GaussianField], direction: Vector) -> Part:
    """Gaussians of several levels from back to front along a direction, and the level of each."""
    level = np.repeat(list(parts), [len(part) for part in parts.values()])
    flat = concatenate_fields(list(parts.values()))
    sequence = sort_back_to_front(flat.means, direction)
    return flat[sequence], level[sequence]


def fade_levels(
    terrain: EndlessTerrain, field: GaussianField, level: Int[Array, "n"], distance: Floats
) -> tuple[GaussianField, Bool[Array, "n"]]:
    """Gaussians with the opacities of their levels' weights at their distances, without Gaussians of weight 0; and
    which are left. A Gaussian of weight 1 keeps its bits.
    """
    weight = level_weights(distance, terrain.switches, terrain.bands)[level, np.arange(len(level))]
    active = weight > 0
    field, weight = field[active], weight[active]
    partial = weight < 1
    if not partial.any():
        return field, active
    opacity = 1 / (1 + np.exp(-field.opacity_logits[partial].astype(float)))
    left = np.maximum(crossfade_opacity(opacity, weight[partial]), 1e-30)
    logits = field.opacity_logits.copy()
    logits[partial] = np.log(left) - np.log1p(-left)
    return replace(field, opacity_logits=logits), active


def cell_direction(terrain: EndlessTerrain, i: int, j: int, tile: int, eye: Vector) -> Vector:
    """Direction of the pre-sorted order that is used for the tile in cell (i, j)."""
    x, y = (i + 0.5) * terrain.side, (j + 0.5) * terrain.side
    height, slope = terrain.heights.at(np.array([x]), np.array([y]))
    to = np.array([x, y, height[0] + 0.5 * sum(terrain.z)]) - eye
    orders = terrain.tile_orders[tile]
    return terrain.directions[orders[nearest_order(terrain.directions, orders, to, slope[0])]]


def group_by_cell(terrain: EndlessTerrain, cells: GridCells, eye: Vector) -> dict[int, Instances]:
    """The objects that stand in cells, by the index of the cell that each is drawn with.

    An object reaches over the edges of its own cell. Of the cells that its footprint touches, the one nearest to the
    eye is drawn last, and the object right after it: else the ground of a nearer cell would cover what hangs over it.
    Where that cell is not visible, the object is drawn with its own.
    """
    if terrain.scatter is None:
        return {}
    found, side = terrain.scatter.instances_in(cells.i, cells.j), terrain.side
    if not len(found):
        return {}
    radius = terrain.scatter.radii(found) / side
    owner = []
    for cell, place, at in ((found.i, found.u, eye[0]), (found.j, found.v, eye[1])):
        low, high = (cell + np.floor(place + step * radius).astype(np.int64) for step in (-1, 1))
        owner.append(np.clip(int(np.floor(at / side)), low, high))
    index = {cell: k for k, cell in enumerate(zip(cells.i.tolist(), cells.j.tolist(), strict=True))}
    own = zip(found.i.tolist(), found.j.tolist(), strict=True)
    drawn = zip(*(each.tolist() for each in owner), strict=True)
    with_cell = np.array([index.get(near, index[foot]) for near, foot in zip(drawn, own, strict=True)])
    order = np.argsort(with_cell, kind="stable")
    numbers, starts = np.unique(with_cell[order], return_index=True)
    return dict(zip(numbers.tolist(), map(found.__getitem__, np.split(order, starts[1:])), strict=True))


def place_objects(terrain: EndlessTerrain, found: Instances, cell: tuple[int, int], eye: Vector) -> Part:
    """The Gaussians of objects, turned, scaled and moved to their feet, at every level that has a weight.

    Positions count from the cell. Objects are sorted by falling distance from the eye to their feet, the Gaussians of
    an object are in the pre-sorted order.
    """
    side = terrain.side
    x, y = (found.i - cell[0] + found.u) * side, (found.j - cell[1] + found.v) * side
    height, slope = terrain.heights.at(x + cell[0] * side, y + cell[1] * side)
    ground = np.array([each.ground for each in terrain.object_entries])[found.number]
    feet = np.stack([x, y, ground], 1)
    to = feet + [cell[0] * side, cell[1] * side, 0.0] - eye
    to[:, 2] += height
    distance = np.linalg.norm(to, axis=1)
    reach = np.array(terrain.extents)[found.number] * found.size * (1 + terrain.heights.bounds[2])
    active = active_range(terrain, distance - reach, distance + reach)
    angle = np.radians(found.turn)
    cos, sin = np.cos(angle), np.sin(angle)
    back = np.stack([cos * to[:, 0] + sin * to[:, 1], cos * to[:, 1] - sin * to[:, 0], to[:, 2]], 1)
    tilt = np.stack([cos * slope[:, 0] + sin * slope[:, 1], cos * slope[:, 1] - sin * slope[:, 0]], 1)
    sequence = np.argsort(-distance, kind="stable").tolist()
    parts = []
    for k in sequence:
        number = int(found.number[k])
        kept, levels = terrain.object_entries[number].orders, terrain.objects[number]
        order = kept[nearest_order(terrain.directions, kept, back[k], tilt[k])]  # as seen by the object
        shown = {level: levels[level] for level in np.flatnonzero(active[:, k]).tolist()}
        parts.append(order_gaussians(shown or {len(levels) - 1: levels[-1][:0]}, terrain.directions[order]))
    field, level = concatenate_parts(parts)
    row = np.repeat(sequence, [len(levels) for _, levels in parts])
    field = turn_and_scale(field, turn_rows(angle)[row], found.size[row], feet[row])
    return colour_objects(terrain, field, found, row, (cell[0] * side, cell[1] * side)), level
