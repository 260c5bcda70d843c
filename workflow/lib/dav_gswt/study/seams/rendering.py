"""Crops of the terrain as `terrain.still.draw` draws it, and of the exemplar in its place, from what reaches into them.

Cells stand back to front, each in its pre-sorted order, those about the eye are sorted together. A patch that is laid
whole is drawn in the order of the cell that the crop's middle lies in: what orders do to a picture is in both.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import SH0, GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.study.seams.spatial_index import Seen, Shelf
from dav_gswt.terrain import placement, splats, visibility
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.endless import EndlessTerrain

SKY = {"zenith": [0.0, 0.0, 0.0], "horizon": [0.0, 0.0, 0.0]}  # crops see none

Look = Callable[[GaussianField, Float[Array, "3"]], Float32[Array, "n 3"]]  # colours of Gaussians counted from the eye


@dataclass(frozen=True)
class Piece:
    """Gaussians by level that lie together in a cell of the terrain: from where they count, in which order they stand,
    whether about the eye.
    """

    parts: dict[int, GaussianField]
    corner: Float[Array, "3"]
    direction: Float[Array, "3"]
    close: bool
    cell: tuple[int, int]


def of_terrain(terrain: EndlessTerrain, camera: Camera, seen: Seen, tiles: dict[tuple[int, int], Shelf]) -> list[Piece]:
    """What of the terrain may show, cell by cell from back to front. tiles: by (level, tile number)."""
    eye, side, found = camera.centre, terrain.side, []
    cells = visibility.visible_cells(terrain, camera)
    active = visibility.active_levels(terrain, cells)
    for k in range(len(cells)):
        i, j, tile = int(cells.i[k]), int(cells.j[k]), int(cells.tile[k])
        corner = np.array([i * side, j * side, 0.0])
        parts = {int(level): tiles[level, tile].near(seen, corner) for level in np.flatnonzero(active[:, k])}
        if any(len(part) for part in parts.values()):
            direction = placement.cell_direction(terrain, i, j, tile, eye)
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
    terrain: EndlessTerrain, pieces: list[Piece], camera: Camera, ground, looks: Sequence[Look] = ()
) -> list[Float32[Array, "h w 3"]]:
    """The picture of pieces that stand back to front, and the same in other colours, over black, for each look.

    ground: colour of what lies behind.
    """
    eye, here = camera.centre, replace(camera, translation=np.zeros(3))
    behind = Backdrop.for_eye(terrain, eye, SKY, ground)
    found = []  # of each piece: its splats, their colours by every look, whether it is about the eye
    for piece in pieces:
        field, slope = placement.place_gaussians(terrain, piece.parts, piece.corner, piece.direction, eye)
        part, which = splats.project_indexed(behind.blend_far(field), slope, here, terrain.near)
        found.append((part, [look(field, eye)[which] for look in looks], piece.close))
    found.sort(key=lambda each: each[2])  # those about the eye come last
    stand = splats.concatenate_splats([splats.EMPTY, *(part for part, _, _ in found)])
    first = sum(len(part) for part, _, close in found if not close)
    order = np.concatenate([np.arange(first), first + splats.depth_order(stand[first:])])
    stand = stand[order]
    seen = splats.blend(stand, here)
    picture = np.clip(seen.colour + (1 - seen.alpha)[..., None] * behind.colours_along(here.rays()[1]), 0, 1)
    painted = (np.concatenate([own[k] for _, own, _ in found])[order] for k in range(len(looks)))
    return [picture, *(splats.blend(replace(stand, colours=own), here).colour for own in painted)]
