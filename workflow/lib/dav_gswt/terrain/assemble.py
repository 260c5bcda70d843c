"""The endless terrain for one eye: which cells it may see, and the Gaussians of each as they are to be drawn there."""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int64
from numpy import ndarray as Array

from dav_gswt.bundle.orders import back_to_front
from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster.interface import RIM
from dav_gswt.terrain import order, weights
from dav_gswt.terrain.choice import tiles_at
from dav_gswt.terrain.drape import lifted
from dav_gswt.terrain.heights import Flat, Heights, of_config

MOST = 10_000_000  # Gaussians in one picture
PAD = 2.0  # pixels, rounded up, by which the rasterizer's widening of splats reaches into the picture
LEAST_SHRINK, HALVINGS = 1e-5, 16  # of the search for a factor on level distances
NEAR = 0.1  # Gaussians nearer than this share of the eye floor are left out


@dataclass(frozen=True)
class Terrain:
    """A tile set ready to be laid.

    tiles: by (level, tile number), positions in [0, side], sorted in no way. switches, bands: where a level gives way
    to the next, and half the width of that (`weights.of_levels`, smooth or not); the last switch is infinite.
    directions, kept: along which orders are sorted, and which of these each tile has. heights: what it all is draped
    over. near: what is nearer is left out. overhang: how far a Gaussian may reach over the edges of its tile. reach:
    tile sides to the end of what is laid; beyond it the far ground has the terrain's mean colour.
    """

    tiles: dict[tuple[int, int], GaussianField]
    side: float
    switches: list[float]
    bands: list[float]
    directions: Float[Array, "d 3"]
    kept: list[list[int]]
    z: tuple[float, float]
    overhang: float
    variants: int
    salt: int
    near: float
    heights: Heights = Flat()
    smooth: bool = False
    reach: int = 48

    def height_range(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n"]]:
        """Between which heights the Gaussians of cells with these centres show, the surface included."""
        half = (0.5 * self.side + self.overhang) * 2**0.5
        middle, _ = self.heights.at(x, y)
        most = self.heights.steepest * half
        low = np.maximum(middle - most, self.heights.low) + self.z[0]
        return low, np.minimum(middle + most, self.heights.high) + self.z[1]


@dataclass(frozen=True)
class Cells:
    """Cells to be drawn, back to front. close: of the 3 x 3 about the eye. nearest, farthest: distances from the eye
    between which all Gaussians of a cell have their centres.
    """

    i: Int64[Array, "n"]
    j: Int64[Array, "n"]
    tile: Int64[Array, "n"]
    close: Bool[Array, "n"]
    nearest: Float[Array, "n"]
    farthest: Float[Array, "n"]

    def __len__(self) -> int:
        return len(self.i)

    def __getitem__(self, index) -> "Cells":
        return Cells(*(getattr(self, f.name)[index] for f in fields(self)))


def of_bundle(bundle: Bundle, surface: dict) -> Terrain:
    """A bundle's Gaussians, as they were rounded, laid over the surface that the config's `heights` asks for.

    Raises: InputError: see `bundle.chunks.read`, `heights.of_config`.
    """
    return of_fields(bundle.fields(), bundle.manifest, surface)


def of_fields(tiles: list[list[GaussianField]], manifest: dict, surface: dict) -> Terrain:
    """tiles[level][tile] laid as a bundle's manifest says, over the surface that the config's `heights` asks for.

    Raises: InputError: as `heights.of_config`.
    """
    levels, listed, side = manifest["levels"], manifest["tiles"], manifest["tile_side"]
    largest = max(float(np.exp(f.log_scales.max(initial=-np.inf))) for row in tiles for f in row)
    thin = (RIM - 3) * largest  # what the manifest's heights, three deviations around the centres, leave out
    return Terrain(
        tiles={(level, tile): f for level, row in enumerate(tiles) for tile, f in enumerate(row)},
        side=side,
        switches=[np.inf if level["distance"] is None else level["distance"] for level in levels],
        bands=[level["band"] for level in levels],
        directions=np.array(manifest["directions"], float),
        kept=[tile["chunks"][0]["orders"] for tile in listed],
        z=(min(tile["z"][0] for tile in listed) - thin, max(tile["z"][1] for tile in listed) + thin),
        overhang=RIM * largest,
        variants=len(tiles[0]) // 16,
        salt=manifest["salt"],
        near=NEAR * manifest["eye_floor"],
        heights=of_config(surface, side),
    )


def visible(terrain: Terrain, camera: Camera) -> Cells:
    """The cells within reach of the eye that a pinhole camera may see, back to front.

    A cell is left out where its box (its square and the overhang, between the heights that its Gaussians may have)
    lies wholly beyond the near plane or one side of the picture: never one of which anything shows.
    """
    eye, side = camera.centre, terrain.side
    at = tuple(int(v) for v in np.floor(eye[:2] / side))
    steps = np.arange(-terrain.reach, terrain.reach + 1, dtype=np.int64)
    i, j = (v.ravel() for v in np.meshgrid(at[0] + steps, at[1] + steps))
    x, y = (i + 0.5) * side, (j + 0.5) * side
    low, high = terrain.height_range(x, y)
    middle = np.stack([x, y, 0.5 * (low + high)], 1) - eye
    half = np.stack([np.full(len(x), 0.5 * side), np.full(len(x), 0.5 * side), 0.5 * (high - low)], 1)
    nearest = np.linalg.norm(np.maximum(np.abs(middle) - half, 0), axis=1)
    farthest = np.linalg.norm(np.abs(middle) + half, axis=1)
    wider = np.array([terrain.overhang, terrain.overhang, 0])
    seen = (nearest < terrain.reach * side) & ~_outside(camera, terrain.near, middle, half + wider)
    sequence, _ = order.back_to_front(i, j, at)
    sequence = sequence[seen[sequence]]
    tile = tiles_at(i, j, terrain.salt, terrain.variants)
    return Cells(i, j, tile, order.around(i, j, at), nearest, farthest)[sequence]


def _outside(camera: Camera, near: float, middle: Float[Array, "n 3"], half: Float[Array, "n 3"]) -> Bool[Array, "n"]:
    """Which boxes, given from the eye, lie wholly on the outer side of one of the frustum's planes."""
    right, down, ahead = camera.rotation
    planes = np.array(
        [
            [*ahead, -near],
            [*(camera.fx * right + (camera.cx + PAD) * ahead), 0],
            [*((camera.width - camera.cx + PAD) * ahead - camera.fx * right), 0],
            [*(camera.fy * down + (camera.cy + PAD) * ahead), 0],
            [*((camera.height - camera.cy + PAD) * ahead - camera.fy * down), 0],
        ]
    )
    most = middle @ planes[:, :3].T + half @ np.abs(planes[:, :3]).T + planes[:, 3]
    return (most < 0).any(1)


def active(terrain: Terrain, cells: Cells) -> Bool[Array, "levels n"]:
    """Which levels have a weight somewhere in each cell."""
    switch, band = np.array(terrain.switches)[:, None], np.array(terrain.bands)[:, None]
    begin = np.concatenate([[[-np.inf]], (switch - band)[:-1]])
    return (cells.nearest <= switch + band) & (cells.farthest >= begin)


def within_budget(terrain: Terrain, cells: Cells, budget: int = MOST) -> Cells:
    """The cells without those, farthest first, that would bring more than so many Gaussians into the picture."""
    nearest_first = np.argsort(cells.nearest, kind="stable")
    count = np.cumsum(sizes(terrain, cells)[nearest_first])
    return cells[np.sort(nearest_first[count <= budget])]


def sizes(terrain: Terrain, cells: Cells) -> Int64[Array, "n"]:
    """How many Gaussians each cell has at the levels that have a weight in it."""
    levels = range(len(terrain.switches))
    all_ = np.array([[len(terrain.tiles[level, t]) for t in cells.tile] for level in levels], np.int64)
    return (all_ * active(terrain, cells)).sum(0)


def coarsened(terrain: Terrain, camera: Camera, budget: int) -> Terrain:
    """The same with all level distances shrunk by one factor, the largest with which a picture has so many Gaussians at
    most; as the page does, which also brings the end of the ground nearer. Where the coarsest level alone has more:
    that level."""
    cells, low, high = visible(terrain, camera), LEAST_SHRINK, 1.0

    def shrunk(factor: float) -> Terrain:
        return replace(
            terrain, switches=[factor * s for s in terrain.switches], bands=[factor * b for b in terrain.bands]
        )

    if sizes(terrain, cells).sum() <= budget:
        return terrain
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if sizes(shrunk(middle), cells).sum() <= budget else (low, middle)
    return shrunk(low)


def laid(terrain: Terrain, cell: Cells, eye: Float[Array, "3"]) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """The Gaussians of one cell, placed relative to the eye, and the surface's slope at each (`drape.axes`).

    So float32 still resolves a disc kilometres out. They are cross-faded between levels by their own distances, and
    stand back to front in the pre-sorted order that serves best. Where two levels are drawn their pre-sorted orders
    are merged: Gaussians of both levels stand at their own depths, and neither level covers the other.
    """
    (i,), (j,), (tile,) = cell.i.tolist(), cell.j.tolist(), cell.tile.tolist()
    parts = {int(level): terrain.tiles[level, tile] for level in np.flatnonzero(active(terrain, cell)[:, 0])}
    corner = np.array([i * terrain.side, j * terrain.side, 0.0])
    return placed(terrain, parts, corner, along(terrain, i, j, tile, eye), eye)


def placed(
    terrain: Terrain,
    parts: dict[int, GaussianField],
    corner: Float[Array, "3"],
    direction: Float[Array, "3"],
    eye: Float[Array, "3"],
) -> tuple[GaussianField, Float[Array, "n 2"]]:
    """`laid` of any Gaussians: those of each level, counted from a corner in the world, in the order of a direction."""
    level, flat = (
        np.repeat(list(parts), [len(part) for part in parts.values()]),
        concatenate_fields(list(parts.values())),
    )
    sequence = back_to_front(flat.means, direction)
    field, slope = lifted(flat[sequence], terrain.heights, corner, eye)
    level, distance = level[sequence], np.linalg.norm(field.means.astype(float), axis=1)
    shares = weights.of_levels(distance, terrain.switches, terrain.bands, terrain.smooth)
    weight = shares[level, np.arange(len(level))]
    drawn = weight > 0
    return _faded(field[drawn], weight[drawn]), slope[drawn]


def along(terrain: Terrain, i: int, j: int, tile: int, eye: Float[Array, "3"]) -> Float[Array, "3"]:
    """The direction whose pre-sorted order a cell is drawn in."""
    x, y = (i + 0.5) * terrain.side, (j + 0.5) * terrain.side
    height, slope = terrain.heights.at(np.array([x]), np.array([y]))
    to = np.array([x, y, height[0] + 0.5 * sum(terrain.z)]) - eye
    kept = terrain.kept[tile]
    return terrain.directions[kept[order.nearest(terrain.directions, kept, to, slope[0])]]


def _faded(field: GaussianField, weight: Float[Array, "n"]) -> GaussianField:
    """Opacities of Gaussians that are drawn with a weight; a whole one keeps its bits."""
    partly = weight < 1
    if not partly.any():
        return field
    opacity = 1 / (1 + np.exp(-field.opacity_logits[partly].astype(float)))
    left = np.maximum(weights.crossfaded(opacity, weight[partly]), 1e-30)
    logits = field.opacity_logits.copy()
    logits[partly] = np.log(left) - np.log1p(-left)
    return replace(field, opacity_logits=logits)
