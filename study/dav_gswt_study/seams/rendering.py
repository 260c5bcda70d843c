"""Render crops of the terrain, or of the exemplar in its place, as stills are rendered, from visible Gaussians alone.

Cells are blended back to front, each in its pre-sorted order; those around the eye are sorted together. A patch alone
has the order of the cell under the crop's middle, so pre-sorting affects both pictures alike.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.field import SH0, GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster.interface import RIM
from dav_gswt.terrain import draw_order, placement, stills, visibility
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import displace_means

SKY = Sky([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])  # crops see none

MAX_SLOPE = 1.5  # ground that an object may hide behind it, over what it hides on level ground

Box = Float[Array, "2 2"]  # south-western and north-eastern corner, in world units
# of Gaussians counted from the eye, their colours
Recolouring = Callable[[GaussianField, Float[Array, "3"]], Float32[Array, "n 3"]]


@dataclass(frozen=True)
class Footprint:
    """The ground under a crop, and the horizontal way of a viewing ray per unit of height."""

    box: Box
    per_height: Float[Array, "2"]

    @classmethod
    def from_camera(cls, camera: Camera, box: Box) -> "Footprint":
        ahead = camera.forward
        return cls(box, ahead[:2] / abs(ahead[2]))

    def occlusion_range(
        self, axis: int, low: Float[Array, "n"], high: Float[Array, "n"]
    ) -> tuple[Float[Array, "n"], ...]:
        """Interval along an axis, relative to their places, in which objects between two heights may hide the ground.

        An object at height z hides it up to MAX_SLOPE z per_height behind itself: less on a slope up, more on a slope
        down. A patch that is placed higher or lower as a whole takes its ground along.
        """
        offset = MAX_SLOPE * self.per_height[axis]
        first, last = (offset * low, offset * high) if offset > 0 else (offset * high, offset * low)
        return np.minimum(first, 0), np.maximum(last, 0)


@dataclass(frozen=True)
class SpatialIndex:
    """A field with its Gaussians sorted from west to east.

    order: their numbers in the field. Of each in that order: its place, its largest radius (`reach`), its lowest and
    highest point. max_extent: the largest radius, the lowest and the highest point of all.
    """

    field: GaussianField
    order: Int[Array, "n"]
    places: Float[Array, "2 n"]
    reach: Float[Array, "n"]
    low: Float[Array, "n"]
    high: Float[Array, "n"]
    max_extent: tuple[float, float, float]

    @classmethod
    def from_field(cls, field: GaussianField) -> "SpatialIndex":
        order = np.argsort(field.means[:, 0], kind="stable")
        means = field.means[order].astype(float)
        reach = RIM * np.exp(field.log_scales.max(1, initial=-np.inf)[order].astype(float))
        low, high = means[:, 2] - reach, means[:, 2] + reach
        max_extent = reach.max(initial=0), low.min(initial=np.inf), high.max(initial=-np.inf)
        return cls(
            field,
            order,
            np.ascontiguousarray(means[:, :2].T),
            reach,
            low,
            high,
            (float(max_extent[0]), float(max_extent[1]), float(max_extent[2])),
        )

    def query(self, footprint: Footprint, corner: Float[Array, "3"]) -> GaussianField:
        """Gaussians that may be visible over a footprint, with the field's origin at `corner`, in the field's order."""
        box = footprint.box - corner[:2]
        columns, visible = self._query_columns(footprint, *box[:, 0]), True
        for axis in (0, 1):
            low, high = footprint.occlusion_range(axis, self.low[columns], self.high[columns])
            places, reach = self.places[axis, columns], self.reach[columns]
            visible &= (places + reach + high > box[0, axis]) & (places - reach + low < box[1, axis])
        return self.field[np.sort(self.order[columns][visible])]

    def _query_columns(self, footprint: Footprint, west: float, east: float) -> slice:
        """The slice of the order that may be visible between west and east, by `max_extent`."""
        widest, lowest, highest = self.max_extent
        (low,), (high,) = footprint.occlusion_range(0, np.array([lowest]), np.array([highest]))
        first, last = west - high - widest, east - low + widest
        return slice(np.searchsorted(self.places[0], first), np.searchsorted(self.places[0], last, side="right"))


@dataclass(frozen=True)
class Piece:
    """The Gaussians of a cell of the terrain, by level. corner: their origin; direction: of their pre-sorted order;
    close: whether the cell is around the eye.
    """

    parts: dict[int, GaussianField]
    corner: Float[Array, "3"]
    direction: Float[Array, "3"]
    close: bool
    cell: tuple[int, int]


def collect_pieces(
    terrain: EndlessTerrain, camera: Camera, footprint: Footprint, tiles: dict[tuple[int, int], SpatialIndex]
) -> list[Piece]:
    """What may be visible of the terrain, cell by cell from back to front. tiles: by (level, tile number)."""
    eye, side, pieces = camera.centre, terrain.side, []
    cells = visibility.visible_cells(terrain, camera)
    active = visibility.active_levels(terrain, cells)
    for k in range(len(cells)):
        i, j, tile = int(cells.i[k]), int(cells.j[k]), int(cells.tile[k])
        corner = np.array([i * side, j * side, 0.0])
        parts = {int(level): tiles[int(level), tile].query(footprint, corner) for level in np.flatnonzero(active[:, k])}
        if any(len(part) for part in parts.values()):
            direction = placement.cell_direction(terrain, i, j, tile, eye)
            pieces.append(Piece(parts, corner, direction, bool(cells.close[k]), (i, j)))
    return pieces


def describe_cell(terrain: EndlessTerrain, eye: Float[Array, "3"], cell: tuple[int, int]) -> Piece:
    """The piece of a cell without its Gaussians, of the levels that it is drawn with."""
    i, j = (np.array([v], np.int64) for v in cell)
    tile, materials = visibility.choose_tiles(terrain, i, j)
    at = (int(np.floor(eye[0] / terrain.side)), int(np.floor(eye[1] / terrain.side)))
    close = draw_order.in_near_block(i, j, at)
    cells = visibility.GridCells(i, j, tile, materials, close, *visibility.bound_cells(terrain, i, j, eye)[2:])
    levels = np.flatnonzero(visibility.active_levels(terrain, cells)[:, 0]).tolist()
    parts = {level: terrain.tiles[level, int(tile[0])][:0] for level in levels}
    direction = placement.cell_direction(terrain, *cell, int(tile[0]), eye)
    return Piece(parts, np.array([*cell, 0.0]) * terrain.side, direction, bool(close[0]), cell)


def make_patch_piece(
    levels: list[SpatialIndex],
    corner: Float[Array, "3"],
    template: Piece,
    correction: Float[Array, "4"],
    footprint: Footprint,
) -> Piece:
    """The visible part of the exemplar with its corner there, the correction added to all colours and heights."""
    parts = {}
    for level in template.parts:
        part = levels[min(level, len(levels) - 1)].query(footprint, corner)  # coarser ones are the tiles' own
        sh = part.sh.copy()
        sh[:, 0] += (correction[:3] / SH0).astype(np.float32)
        parts[level] = replace(part, sh=sh)
    return replace(template, parts=parts, corner=corner + [0, 0, correction[3]])


def render_pieces(
    terrain: EndlessTerrain, pieces: list[Piece], camera: Camera, ground, recolourings: Sequence[Recolouring] = ()
) -> list[Float32[Array, "h w 3"]]:
    """The picture of pieces, given back to front, and the same over black in the colours of each recolouring.

    ground: colour of the far ground.
    """
    eye, here = camera.centre, replace(camera, translation=np.zeros(3))
    behind = Backdrop.for_eye(terrain, eye, SKY, ground)
    parts = []  # of each piece: its splats, their colours by every recolouring, whether it is close
    for piece in pieces:
        field, level = placement.order_gaussians(piece.parts, piece.direction)
        field, slope = displace_means(field, terrain.heights, piece.corner, eye)
        distance = np.linalg.norm(field.means.astype(float), axis=1)
        field, active = placement.fade_levels(terrain, field, level, distance)
        part, indices = stills.project(behind.blend_far(field, slope[active]), slope[active], here, terrain.near)
        parts.append((part, [recolour(field, eye)[indices] for recolour in recolourings], piece.close))
    parts.sort(key=lambda each: each[2])  # close pieces come last
    ordered = stills.Splats.concatenate([stills.EMPTY, *(part for part, _, _ in parts)])
    first = sum(len(part) for part, _, close in parts if not close)
    order = np.concatenate([np.arange(first), first + stills.depth_order(ordered[first:])])
    ordered = ordered[order]
    footprint = stills.blend(ordered, here)
    picture = np.clip(footprint.colour + (1 - footprint.alpha)[..., None] * behind.colours_along(here.rays()[1]), 0, 1)
    recoloured = (np.concatenate([own[k] for _, own, _ in parts])[order] for k in range(len(recolourings)))
    return [picture, *(stills.blend(replace(ordered, colours=own), here).colour for own in recoloured)]
