"""Crops of the terrain as `terrain.still.draw` draws it, and of the exemplar in its place, from what reaches into them.

Cells stand back to front, each in its pre-sorted order, those about the eye are sorted together. A patch that is laid
whole is drawn in the order of the cell that the crop's middle lies in: what orders do to a picture is in both.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.field import SH0, Field
from dav_gswt.raster.interface import RIM
from dav_gswt.terrain import assemble, splats
from dav_gswt.terrain.assemble import Terrain
from dav_gswt.terrain.backdrop import Backdrop

SLOPES = 1.5  # how much more ground than where it is level a thing may hide behind it
SKY = {"zenith": [0.0, 0.0, 0.0], "horizon": [0.0, 0.0, 0.0]}  # crops see none

Box = Float[Array, "2 2"]  # south-western and north-eastern corner, in world units
Look = Callable[[Field, Float[Array, "3"]], Float32[Array, "n 3"]]  # colours of Gaussians counted from the eye


@dataclass(frozen=True)
class Piece:
    """Gaussians by level that lie together in a cell of the terrain: from where they count, in which order they stand,
    whether about the eye.
    """

    parts: dict[int, Field]
    corner: Float[Array, "3"]
    direction: Float[Array, "3"]
    close: bool
    cell: tuple[int, int]


@dataclass(frozen=True)
class Extent:
    """Of a level: its lowest and highest point, and how far a Gaussian reaches from its centre at most."""

    low: float
    high: float
    reach: float

    @classmethod
    def of(cls, fields: list[Field]) -> "Extent":
        reach = [RIM * np.exp(field.log_scales.max(1, initial=-np.inf)) for field in fields]
        low = min((f.means[:, 2] - r).min(initial=np.inf) for f, r in zip(fields, reach, strict=True))
        high = max((f.means[:, 2] + r).max(initial=-np.inf) for f, r in zip(fields, reach, strict=True))
        return cls(float(low), float(high), float(max(r.max(initial=0) for r in reach)))


@dataclass(frozen=True)
class Seen:
    """The ground that a crop looks at, and how far a ray that hits level ground comes from per unit of height."""

    box: Box
    per_height: Float[Array, "2"]

    def holds(self, corner: Float[Array, "3"], side: float, extent: "Extent") -> bool:
        """Whether anything of a cell may show whose Gaussians have this extent."""
        low, high = self.margin(extent)
        first, last = corner[:2], corner[:2] + side
        return bool(((last + high > self.box[0]) & (first + low < self.box[1])).all())

    def margin(self, extent: "Extent") -> tuple[Float[Array, "2"], Float[Array, "2"]]:
        """From where to where, counted from its place, a Gaussian of this extent may show at most."""
        low, high = self._hidden(np.array([extent.low, extent.high]))
        return low - extent.reach, high + extent.reach

    @classmethod
    def of(cls, camera: Camera, box: Box) -> "Seen":
        ahead = camera.forward
        return cls(box, ahead[:2] / abs(ahead[2]))

    def shows(self, field: Field, corner: Float[Array, "3"]) -> Bool[Array, "n"]:
        """Gaussians, counted from a corner, of which some part may show over the box."""
        reach = RIM * np.exp(field.log_scales.max(1, initial=-np.inf))[:, None]
        low, high = self._hidden(field.means[:, 2] + reach.T * [[-1], [1]])
        places = field.means[:, :2] + corner[:2]
        return ((places + reach + high > self.box[0]) & (places - reach + low < self.box[1])).all(1)

    def _hidden(self, z: Float[Array, "2 *n"]) -> tuple[Float[Array, "*n 2"], Float[Array, "*n 2"]]:
        """From where to where, counted from their places, things between two heights may hide the ground.

        One at a height z hides it up to SLOPES times z per_height behind itself: on a slope up it is less, on a slope
        down more. A patch that is laid higher or lower as a whole takes its ground along.
        """
        behind = SLOPES * z[..., None] * self.per_height
        return np.minimum(behind.min(0), 0), np.maximum(behind.max(0), 0)


@dataclass(frozen=True)
class Shelf:
    """A level of the exemplar, and its Gaussians from west to east: of many a crop shows few."""

    field: Field
    order: Int[Array, "n"]
    east: Float[Array, "n"]  # of each in that order
    extent: Extent

    @classmethod
    def of(cls, field: Field) -> "Shelf":
        east = field.means[:, 0].astype(float)
        order = np.argsort(east, kind="stable")
        return cls(field, order, east[order], Extent.of([field]))

    def near(self, seen: Seen, corner: Float[Array, "3"]) -> Field:
        """Those that may show (`Seen.shows`), in the field's own order."""
        low, high = seen.margin(self.extent)
        first, last = seen.box[:, 0] - corner[0] - [high[0], low[0]]
        among = np.sort(self.order[np.searchsorted(self.east, first) : np.searchsorted(self.east, last, side="right")])
        part = self.field[among]
        return part[seen.shows(part, corner)]


def of_terrain(terrain: Terrain, camera: Camera, seen: Seen, extents: list[Extent]) -> list[Piece]:
    """What of the terrain may show, cell by cell from back to front. extents: of its levels."""
    eye, side, found = camera.centre, terrain.side, []
    cells = assemble.visible(terrain, camera)
    active = assemble.active(terrain, cells)
    for k in range(len(cells)):
        i, j, tile = int(cells.i[k]), int(cells.j[k]), int(cells.tile[k])
        corner = np.array([i * side, j * side, 0.0])
        levels = [int(level) for level in np.flatnonzero(active[:, k])]
        if not any(seen.holds(corner, side, extents[level]) for level in levels):
            continue
        fields = {level: terrain.tiles[level, tile] for level in levels}
        parts = {level: field[seen.shows(field, corner)] for level, field in fields.items()}
        if any(len(part) for part in parts.values()):
            direction = assemble.along(terrain, i, j, tile, eye)
            found.append(Piece(parts, corner, direction, bool(cells.close[k]), (i, j)))
    return found


def of_patch(
    levels: list[Shelf], corner: Float[Array, "3"], like: Piece, change: Float[Array, "4"], seen: Seen
) -> Piece:
    """The exemplar with its corner there, where it may show; colours and heights changed throughout."""
    parts = {}
    for level in like.parts:
        part = levels[min(level, len(levels) - 1)].near(seen, corner)  # coarser ones are the tiles' own
        sh = part.sh.copy()
        sh[:, 0] += (change[:3] / SH0).astype(np.float32)
        parts[level] = replace(part, sh=sh)
    return replace(like, parts=parts, corner=corner + [0, 0, change[3]])


def drawn(
    terrain: Terrain, pieces: list[Piece], camera: Camera, ground, looks: Sequence[Look] = ()
) -> list[Float32[Array, "h w 3"]]:
    """The picture of pieces that stand back to front, and the same in other colours, over black, for each look.

    ground: colour of what lies behind.
    """
    eye, here = camera.centre, replace(camera, translation=np.zeros(3))
    behind = Backdrop.of(terrain, eye, SKY, ground)
    found = []  # of each piece: its splats, their colours by every look, whether it is about the eye
    for piece in pieces:
        field, slope = assemble.placed(terrain, piece.parts, piece.corner, piece.direction, eye)
        part, which = splats.indexed(behind.over(field), slope, here, terrain.near)
        found.append((part, [look(field, eye)[which] for look in looks], piece.close))
    found.sort(key=lambda each: each[2])  # those about the eye come last
    stand = splats.joined([splats.NONE, *(part for part, _, _ in found)])
    first = sum(len(part) for part, _, close in found if not close)
    order = np.concatenate([np.arange(first), first + splats.by_depth(stand[first:])])
    stand = stand[order]
    seen = splats.blended(stand, here)
    picture = np.clip(seen.colour + (1 - seen.alpha)[..., None] * behind.seen_along(here.rays()[1]), 0, 1)
    painted = (np.concatenate([own[k] for _, own, _ in found])[order] for k in range(len(looks)))
    return [picture, *(splats.blended(replace(stand, colours=own), here).colour for own in painted)]
