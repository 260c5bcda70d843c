"""Visible cells: which cells of the endless terrain a camera may see, at which levels, within a budget of Gaussians."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.field import Rows
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain import draw_order
from dav_gswt.terrain.choice import Floats, Ints, Vector, tiles_at
from dav_gswt.terrain.endless import EndlessTerrain

PAD = 2.0  # pixels, rounded up, by which the rasterizer's dilation of splats reaches into the picture
MIN_FACTOR, BISECTIONS = 1e-5, 16  # of the search for a factor on level distances

Points = Float[Array, "n 3"]


@dataclass(frozen=True)
class GridCells(Rows):
    """Cells of the tile grid, back to front. tile: that of the first material in the cell. materials: which materials
    the cell may show, bit m for material m. close: in the 3 x 3 block about the eye. nearest, farthest: bounds of the
    distances from the eye to the centres of a cell's Gaussians.
    """

    i: Ints
    j: Ints
    tile: Ints
    materials: Ints
    close: Bool[Array, "n"]
    nearest: Floats
    farthest: Floats


def visible_cells(terrain: EndlessTerrain, camera: Camera) -> GridCells:
    """The cells within reach of the eye that a pinhole camera may see, back to front.

    A cell is culled where its bounding box (its square with the overhang, between the heights of its Gaussians) lies
    wholly outside one plane of the frustum. The test is conservative: no visible Gaussian is lost.
    """
    eye, side = camera.centre, terrain.side
    at = (int(np.floor(eye[0] / side)), int(np.floor(eye[1] / side)))
    steps = np.arange(-terrain.reach, terrain.reach + 1, dtype=np.int64)
    i, j = (v.ravel() for v in np.meshgrid(at[0] + steps, at[1] + steps))
    middle, half, nearest, farthest = bound_cells(terrain, i, j, eye)
    planes = frustum_planes(camera, terrain.near)
    wide = half + [terrain.overhang, terrain.overhang, 0]
    most = middle @ planes[:, :3].T + wide @ np.abs(planes[:, :3]).T + planes[:, 3]
    seen = (nearest < terrain.reach * side) & (most >= 0).all(1)
    sequence = draw_order.sort_cells(i, j, at)
    sequence = sequence[seen[sequence]]
    i, j = i[sequence], j[sequence]
    tile, materials = choose_tiles(terrain, i, j)
    close = draw_order.in_near_block(i, j, at)
    return GridCells(i, j, tile, materials, close, nearest[sequence], farthest[sequence])


def bound_cells(terrain: EndlessTerrain, i: Ints, j: Ints, eye: Vector) -> tuple[Points, Points, Floats, Floats]:
    """Boxes of the centres of cells' Gaussians: middles from an eye, half extents, least and greatest distances."""
    side, surface = terrain.side, terrain.heights
    x, y = (i + 0.5) * side, (j + 0.5) * side
    middle, _ = surface.at(x, y)
    lowest, highest, steepest = surface.bounds
    most = steepest * (0.5 * side + terrain.overhang) * 2**0.5
    low = np.maximum(middle - most, lowest) + terrain.z[0]
    high = np.minimum(middle + most, highest) + terrain.z[1]
    middle = np.stack([x, y, 0.5 * (low + high)], 1) - eye
    half = np.stack([np.full(len(x), 0.5 * side), np.full(len(x), 0.5 * side), 0.5 * (high - low)], 1)
    nearest = np.linalg.norm(np.maximum(np.abs(middle) - half, 0), axis=1)
    return middle, half, nearest, np.linalg.norm(np.abs(middle) + half, axis=1)


def choose_tiles(terrain: EndlessTerrain, i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """Tile of the first material in each cell, and which materials it may show, bit m for material m."""
    tile = tiles_at(i, j, terrain.salt, terrain.variants)
    if terrain.classes is None:
        return tile, np.ones(len(i), np.int64)
    materials = terrain.classes.materials_in(i, j)
    first = np.argmax(materials[:, None] >> np.arange(8) & 1, axis=1)  # the lowest bit that is set
    return tile + terrain.tiles_each * first, materials


def frustum_planes(camera: Camera, near: float) -> Float[Array, "5 4"]:
    """Near, left, right, upper and lower plane: inward normal and distance."""
    right, down, ahead = camera.rotation
    return np.array(
        [
            [*ahead, -near],
            [*(camera.fx * right + (camera.cx + PAD) * ahead), 0],
            [*((camera.width - camera.cx + PAD) * ahead - camera.fx * right), 0],
            [*(camera.fy * down + (camera.cy + PAD) * ahead), 0],
            [*((camera.height - camera.cy + PAD) * ahead - camera.fy * down), 0],
        ]
    )


def active_levels(terrain: EndlessTerrain, cells: GridCells) -> Bool[Array, "levels n"]:
    """Which levels have a weight somewhere in each cell."""
    return active_range(terrain, cells.nearest, cells.farthest)


def active_range(terrain: EndlessTerrain, nearest: Floats, farthest: Floats) -> Bool[Array, "levels n"]:
    """Which levels have a weight somewhere between two distances from the eye."""
    switch, band = np.array(terrain.switches)[:, None], np.array(terrain.bands)[:, None]
    begin = np.concatenate([[[-np.inf]], (switch - band)[:-1]])
    return (nearest <= switch + band) & (farthest >= begin)


def count_gaussians(terrain: EndlessTerrain, cells: GridCells) -> Ints:
    """Number of Gaussians in each cell, and of the objects whose feet lie in it, over its active levels."""
    return (count_levels(terrain, cells) * active_levels(terrain, cells)).sum(0)


def count_levels(terrain: EndlessTerrain, cells: GridCells) -> Int[Array, "levels n"]:
    """Number of Gaussians in each cell, and of the objects whose feet lie in it, at each level."""
    levels, each = range(len(terrain.switches)), terrain.tiles_each
    kinds = 1 if terrain.classes is None else terrain.classes.materials
    sizes = np.array([[len(terrain.tiles[level, t]) for t in range(kinds * each)] for level in levels], np.int64)
    counts = np.zeros((len(levels), len(cells)), np.int64)
    for m in range(kinds):
        counts += sizes[:, m * each + cells.tile % each] * (cells.materials >> m & 1)
    if terrain.scatter is not None:
        found = terrain.scatter.instances_in(cells.i, cells.j)
        index = {cell: k for k, cell in enumerate(zip(cells.i.tolist(), cells.j.tolist(), strict=True))}
        owner = np.array([index[cell] for cell in zip(found.i.tolist(), found.j.tolist(), strict=True)], int)
        sizes = np.array([[len(fields[level]) for fields in terrain.objects] for level in levels])
        counts += np.array([np.bincount(owner, size[found.number], len(cells)) for size in sizes]).astype(np.int64)
    return counts


def coarsen_to_budget(
    terrain: EndlessTerrain, camera: Camera, budget: int, cells: GridCells | None = None
) -> EndlessTerrain:
    """Multiply all level distances by one factor, the largest with which a picture has at most `budget` Gaussians.

    The viewer does the same and also moves the end of the ground nearer. Where the coarsest level alone exceeds the
    budget, that level is used. cells: those that the camera sees, if they are known.
    """
    cells, low, high = visible_cells(terrain, camera) if cells is None else cells, MIN_FACTOR, 1.0

    def scale_distances(factor: float) -> EndlessTerrain:
        return replace(
            terrain, switches=[factor * s for s in terrain.switches], bands=[factor * b for b in terrain.bands]
        )

    if count_gaussians(terrain, cells).sum() <= budget:
        return terrain
    for _ in range(BISECTIONS):
        middle = float(np.sqrt(low * high))
        fits = count_gaussians(scale_distances(middle), cells).sum() <= budget
        low, high = (middle, high) if fits else (low, middle)
    return scale_distances(low)
