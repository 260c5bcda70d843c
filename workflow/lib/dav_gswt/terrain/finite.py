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
from dav_gswt.terrain.placement import Part, active_objects, collect_tiles, concatenate_parts, fade_levels
from dav_gswt.terrain.scatter import Instances
from dav_gswt.terrain.visibility import GridCells, active_levels, choose_tiles, count_gaussians, measure_distances

BLOCK = 65_536  # Gaussians that are placed at once, about
SLICE = 4096  # cells that are counted at once

Placer = Callable[[], GaussianField]


@dataclass(frozen=True)
class Area:
    """A rectangle of cells: its south-western cell, and how many there are to the east and to the north."""

    west: int
    south: int
    columns: int
    rows: int

    def __len__(self) -> int:
        return self.columns * self.rows


def list_cells(
    terrain: EndlessTerrain, west: int, south: int, columns: int, rows: int
) -> tuple[Ints, Ints, Ints, Ints]:
    """Column, row, tile number and materials (bit m for material m) of cells, row by row from the south-western one.

    Raises: InputError: the terrain is a sphere.
    """
    require_plane(terrain)
    i, j = (v.ravel() for v in np.meshgrid(west + np.arange(columns), south + np.arange(rows)))
    return i, j, *choose_tiles(terrain, i, j)


def require_plane(terrain: EndlessTerrain) -> None:
    """Refuse a planet, of which no rectangle of cells can be cut. Raises: InputError."""
    if isinstance(terrain.heights, Sphere):
        raise InputError("heights: a rectangle of cells is cut from a plane: choose another surface than `sphere`")


def keep_level(terrain: EndlessTerrain, level: int) -> EndlessTerrain:
    """The terrain that shows one level at any distance."""
    count = len(terrain.switches)
    return replace(terrain, switches=[-np.inf] * level + [np.inf] * (count - level), bands=[0.0] * count)


def list_grid(terrain: EndlessTerrain, area: Area, eye: Vector) -> GridCells:
    """The cells of an area, row by row, with their distances from an eye."""
    i, j, tile, materials = list_cells(terrain, area.west, area.south, area.columns, area.rows)
    return GridCells(i, j, tile, materials, np.zeros(len(i), bool), *measure_distances(terrain, i, j, eye))


def count_cells(terrain: EndlessTerrain, area: Area, eye: Vector) -> Ints:
    """Most Gaussians of each cell of an area, objects included. Where materials meet or levels fade there are fewer."""
    return count_in_slices(terrain, list_grid(terrain, area, eye))


def count_in_slices(terrain: EndlessTerrain, cells: GridCells) -> Ints:
    """`count_gaussians` of many cells, SLICE at a time: so memory does not grow with what is known of each of them."""
    slices = [cells[first : first + SLICE] for first in range(0, len(cells), SLICE)]
    return np.concatenate([np.zeros(0, np.int64), *(count_gaussians(terrain, some) for some in slices)])


def collect_cells(terrain: EndlessTerrain, west: int, south: int, columns: int, rows: int, level: int) -> GaussianField:
    """Gaussians of `columns` x `rows` cells and of the objects whose feet lie in them, on the surface.

    Positions count from the south-western corner of the cell (west, south), so float32 resolves them far out.
    """
    corner = np.array([west * terrain.side, south * terrain.side, 0.0])
    area, kept = Area(west, south, columns, rows), keep_level(terrain, level)
    return place_block(kept, list_grid(kept, area, corner), corner, corner)()


def list_blocks(terrain: EndlessTerrain, area: Area, eye: Vector) -> list[GridCells]:
    """The cells of an area in blocks of about BLOCK Gaussians, row by row. eye: see `place_block`."""
    cells = list_grid(terrain, area, eye)
    if not len(cells):
        return []
    block = np.cumsum(count_in_slices(terrain, cells)) // BLOCK
    return [cells[rows] for rows in np.split(np.arange(len(cells)), np.flatnonzero(np.diff(block)) + 1)]


def place_block(terrain: EndlessTerrain, cells: GridCells, eye: Vector, origin: Vector) -> Placer:
    """A function that puts the Gaussians of some cells on the surface. It may run in any thread; this one may not.

    Args:   eye: levels are chosen and faded by the distance from it. origin: world position that positions count from.
    """
    side, active, parts = terrain.side, active_levels(terrain, cells), []
    corner = np.array([cells.i[0] * side, cells.j[0] * side, 0.0])
    for k in range(len(cells)):
        by = np.array([cells.i[k] * side, cells.j[k] * side, 0.0]) - corner
        levels = np.flatnonzero(active[:, k]).tolist()
        for level, field in collect_tiles(terrain, cells[k : k + 1], levels).items():
            parts.append((replace(field, means=(field.means + by).astype(np.float32)), np.full(len(field), level)))
    field, level = concatenate_parts([*parts, *_place_objects(terrain, cells, corner, eye)])

    def place() -> GaussianField:
        raised = displace_field(field, terrain.heights, corner, origin)
        return fade_levels(terrain, raised, level, np.linalg.norm(raised.means + (origin - eye), axis=1))[0]

    return place


def _place_objects(terrain: EndlessTerrain, cells: GridCells, corner: Vector, eye: Vector) -> Iterator[Part]:
    """The Gaussians of all objects whose feet lie in cells, at their active levels."""
    if terrain.scatter is None or not len(found := terrain.scatter.instances_in(cells.i, cells.j)):
        return
    feet = place_feet(terrain, found)
    away = feet - eye
    away[:, 2] += terrain.heights.at(feet[:, 0], feet[:, 1])[0]
    active = active_objects(terrain, found, np.linalg.norm(away, axis=1))
    way = turn_rows(np.radians(found.turn))
    for level in np.flatnonzero(active.any(1)).tolist():
        shown = np.flatnonzero(active[level])
        fields = [terrain.objects[number][level] for number in found.number[shown].tolist()]
        row = np.repeat(shown, [len(field) for field in fields])
        placed = turn_and_scale(concatenate_fields(fields), way[row], found.size[row], (feet - corner)[row])
        yield placed, np.full(len(placed), level)


def place_feet(terrain: EndlessTerrain, found: Instances) -> Float[Array, "n 3"]:
    """World positions of objects' feet above the plane z = 0, before the surface lifts them."""
    ground = np.array([each.ground for each in terrain.object_entries])[found.number]
    return np.stack([(found.i + found.u) * terrain.side, (found.j + found.v) * terrain.side, ground], 1)
