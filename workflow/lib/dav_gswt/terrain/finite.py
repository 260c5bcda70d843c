"""A finite piece of the endless terrain as one field: some cells at one level of detail, with everything on them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Int64
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.materials.placing import turn_and_scale, turn_rows
from dav_gswt.terrain.displacement import displace_field
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.placement import collect_tiles
from dav_gswt.terrain.visibility import GridCells, choose_tiles


def list_cells(
    terrain: EndlessTerrain, west: int, south: int, columns: int, rows: int
) -> tuple[Int64[Array, "n"], Int64[Array, "n"], Int64[Array, "n"], Int64[Array, "n"]]:
    """Column, row, tile number and materials (bit m for material m) of cells, row by row from the south-western one."""
    i, j = (v.ravel() for v in np.meshgrid(west + np.arange(columns), south + np.arange(rows)))
    return i, j, *choose_tiles(terrain, i, j)


def collect_cells(terrain: EndlessTerrain, west: int, south: int, columns: int, rows: int, level: int) -> GaussianField:
    """Gaussians of `columns` x `rows` cells and of the objects whose feet lie in them, on the surface.

    Positions count from the south-western corner of the cell (west, south), so float32 resolves them far out.
    """
    corner = np.array([west * terrain.side, south * terrain.side, 0.0])
    parts = [*_place_tiles(terrain, (west, south, columns, rows), level)]
    if (things := _place_objects(terrain, (west, south, columns, rows), level)) is not None:
        parts.append(things)
    return displace_field(concatenate_fields(parts), terrain.heights, corner, corner)


def _place_tiles(terrain: EndlessTerrain, area: tuple[int, int, int, int], level: int) -> Iterator[GaussianField]:
    """Each cell's Gaussians, from the corner of the first one."""
    i, j, tile, materials = list_cells(terrain, *area)
    none = np.zeros(len(i))
    cells = GridCells(i, j, tile, materials, none.astype(bool), none, none)
    for k in range(len(i)):
        field = collect_tiles(terrain, cells[k : k + 1], [level])[level]
        yield _move(field, np.array([(i[k] - area[0]) * terrain.side, (j[k] - area[1]) * terrain.side, 0.0]))


def _place_objects(terrain: EndlessTerrain, area: tuple[int, int, int, int], level: int) -> GaussianField | None:
    """The Gaussians of all objects whose feet lie in cells; None where there are none."""
    if terrain.scatter is None:
        return None
    i, j, _, _ = list_cells(terrain, *area)
    found = terrain.scatter.instances_in(i, j)
    if not len(found):
        return None
    ground = np.array([each.ground for each in terrain.object_entries])[found.number]
    feet = np.stack(
        [(found.i - area[0] + found.u) * terrain.side, (found.j - area[1] + found.v) * terrain.side, ground], 1
    )
    fields = [terrain.objects[number][level] for number in found.number.tolist()]
    row = np.repeat(np.arange(len(found)), [len(field) for field in fields])
    way = turn_rows(np.radians(found.turn))
    return turn_and_scale(concatenate_fields(fields), way[row], found.size[row], feet[row])


def _move(field: GaussianField, by: Array) -> GaussianField:
    return replace(field, means=(field.means + by).astype(np.float32))
