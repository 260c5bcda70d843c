"""Placement of objects: which are drawn with which cell, and their Gaussians in the cell's coordinates."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.bundle.orders import sort_back_to_front
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.materials.model import turn_and_scale, turn_rows
from dav_gswt.terrain import draw_order
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.scatter import Instances
from dav_gswt.terrain.visibility import GridCells, active_range


@dataclass(frozen=True)
class PlacedObjects:
    """Gaussians of the objects drawn with one cell, back to front, and their levels; positions count from the cell.

    Objects come by falling distance from the eye to their feet, the Gaussians of one in the pre-sorted order.
    """

    field: GaussianField
    level: Int[Array, "n"]


def group_by_cell(terrain: EndlessTerrain, cells: GridCells, eye: Float[Array, "3"]) -> dict[int, Instances]:
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
    radius = np.array([each.radius for each in terrain.scatter.objects])[found.number] * found.size / side
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


def place_objects(
    terrain: EndlessTerrain, found: Instances, cell: tuple[int, int], eye: Float[Array, "3"]
) -> PlacedObjects:
    """The Gaussians of objects, turned, scaled and moved to their feet, at every level that has a weight."""
    side = terrain.side
    x, y = (found.i - cell[0] + found.u) * side, (found.j - cell[1] + found.v) * side
    height, slope = terrain.heights.at(x + cell[0] * side, y + cell[1] * side)
    ground = np.array([each.ground for each in terrain.object_entries])[found.number]
    feet = np.stack([x, y, ground], 1)
    to = feet + [cell[0] * side, cell[1] * side, 0.0] - eye
    to[:, 2] += height
    distance, extent = np.linalg.norm(to, axis=1), np.array(terrain.extents)[found.number] * found.size
    reach = extent * (1 + terrain.heights.steepest)
    active = active_range(terrain, distance - reach, distance + reach)
    angle = np.radians(found.turn)
    cos, sin = np.cos(angle), np.sin(angle)
    back = np.stack([cos * to[:, 0] + sin * to[:, 1], cos * to[:, 1] - sin * to[:, 0], to[:, 2]], 1)
    tilt = np.stack([cos * slope[:, 0] + sin * slope[:, 1], cos * slope[:, 1] - sin * slope[:, 0]], 1)
    fields, levels, rows = [], [], []
    for k in np.argsort(-distance, kind="stable").tolist():
        field, level = _order_levels(terrain, int(found.number[k]), active[:, k], back[k], tilt[k])
        fields.append(field)
        levels.append(level)
        rows.append(np.full(len(level), k))
    field, row = concatenate_fields(fields), np.concatenate(rows)
    return PlacedObjects(
        turn_and_scale(field, turn_rows(angle)[row], found.size[row], feet[row]), np.concatenate(levels)
    )


def _order_levels(
    terrain: EndlessTerrain, number: int, active: Bool[Array, "levels"], to: Float[Array, "3"], slope: Float[Array, "2"]
) -> tuple[GaussianField, Int[Array, "n"]]:
    """An object's Gaussians of the active levels in the order nearest to the viewing direction, and their levels.

    Args:   to, slope: from the eye to the foot, and of the surface there, turned back with the object.
    """
    kept = terrain.object_entries[number].chunks[0].orders
    order = kept[draw_order.nearest_order(terrain.directions, kept, to, slope)]
    place = (number, order, *np.flatnonzero(active).tolist())
    if place not in terrain.ordered:
        parts = {level: terrain.objects[number][level] for level in place[2:]}
        if not parts:
            parts = {len(terrain.switches) - 1: terrain.objects[number][-1][:0]}
        field = concatenate_fields(list(parts.values()))
        level = np.repeat(list(parts), [len(part) for part in parts.values()])
        sequence = sort_back_to_front(field.means, terrain.directions[order])
        terrain.ordered[place] = field[sequence], level[sequence]
    return terrain.ordered[place]
