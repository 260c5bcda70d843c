"""A finite piece of the endless terrain as Gaussians of one file: some cells, with everything on them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.materials.model import turn_and_scale, turn_rows
from dav_gswt.terrain.choice import Ints, Vector
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import Sphere, displace_field
from dav_gswt.terrain.placement import collect_tiles, colour_objects
from dav_gswt.terrain.scatter import Instances
from dav_gswt.terrain.visibility import GridCells, choose_tiles, count_levels

BLOCK = 65_536  # Gaussians that are placed at once, about
SLICE = 4096  # cells that are counted at once


@dataclass(frozen=True)
class Area:
    """A rectangle of cells: its south-western cell, and how many there are to the east and to the north."""

    west: int
    south: int
    columns: int
    rows: int


def list_cells(terrain: EndlessTerrain, area: Area) -> GridCells:
    """The cells of an area, row by row from the south. Of one level alone, their distances from an eye do not matter.

    Raises: InputError: the terrain is a sphere.
    """
    require_plane(terrain)
    columns, rows = area.west + np.arange(area.columns), area.south + np.arange(area.rows)
    i, j = (v.ravel() for v in np.meshgrid(columns, rows))
    return GridCells(i, j, *choose_tiles(terrain, i, j), np.zeros(len(i), bool), np.zeros(len(i)), np.zeros(len(i)))


def require_plane(terrain: EndlessTerrain) -> None:
    """Refuse a planet, of which no rectangle of cells can be cut. Raises: InputError."""
    if isinstance(terrain.heights, Sphere):
        raise InputError("heights: a rectangle of cells is cut from a plane: choose another surface than `sphere`")


def count_cells(terrain: EndlessTerrain, cells: GridCells, level: int) -> Ints:
    """Most Gaussians of each cell at a level, objects included. Where materials meet there are fewer.

    SLICE cells are counted at a time: so memory does not grow with what is known of each of them.
    """
    slices = [cells[first : first + SLICE] for first in range(0, len(cells), SLICE)]
    return np.concatenate([count_levels(terrain, some)[level] for some in slices])


def list_blocks(terrain: EndlessTerrain, area: Area, level: int) -> list[GridCells]:
    """The cells of an area in blocks of about BLOCK Gaussians of a level, row by row."""
    cells = list_cells(terrain, area)
    block = np.cumsum(count_cells(terrain, cells, level)) // BLOCK
    return [cells[rows] for rows in np.split(np.arange(len(cells)), np.flatnonzero(np.diff(block)) + 1)]


def place_block(terrain: EndlessTerrain, cells: GridCells, level: int, origin: Vector) -> Callable[[], GaussianField]:
    """A function that puts the Gaussians of some cells on the surface. It may run in any thread; this one may not.

    origin: world position that positions count from.
    """
    side, parts = terrain.side, []
    corner = np.array([cells.i[0] * side, cells.j[0] * side, 0.0])
    for k in range(len(cells)):
        by = np.array([cells.i[k] * side, cells.j[k] * side, 0.0]) - corner
        field = collect_tiles(terrain, cells[k : k + 1], [level])[level]
        parts.append(replace(field, means=(field.means + by).astype(np.float32)))
    field = concatenate_fields([*parts, *_place_objects(terrain, cells, level, corner)])
    return lambda: displace_field(field, terrain.heights, corner, origin)


def _place_objects(terrain: EndlessTerrain, cells: GridCells, level: int, corner: Vector) -> Iterator[GaussianField]:
    """The Gaussians of all objects whose feet lie in cells."""
    if terrain.scatter is None or not len(found := terrain.scatter.instances_in(cells.i, cells.j)):
        return
    fields = [terrain.objects[number][level] for number in found.number.tolist()]
    row = np.repeat(np.arange(len(found)), [len(field) for field in fields])
    feet, way = place_feet(terrain, found) - corner, turn_rows(np.radians(found.turn))
    field = turn_and_scale(concatenate_fields(fields), way[row], found.size[row], feet[row])
    yield colour_objects(terrain, field, found, row, corner[:2].tolist())


def place_feet(terrain: EndlessTerrain, found: Instances) -> Float[Array, "n 3"]:
    """World positions of objects' feet above the plane z = 0, before the surface lifts them."""
    ground = np.array([each.ground for each in terrain.object_entries])[found.number]
    return np.stack([(found.i + found.u) * terrain.side, (found.j + found.v) * terrain.side, ground], 1)
