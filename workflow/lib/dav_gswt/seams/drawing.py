"""Crops of the terrain as `terrain.still.draw` draws it, and of the exemplar in its place, from what reaches into them.

Cells stand back to front, each in its pre-sorted order, those about the eye are sorted together. A patch that is laid
whole is drawn in the order of the cell that the crop's middle lies in: what orders do to a picture is in both.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.field import SH0, Field
from dav_gswt.terrain import assemble, splats
from dav_gswt.terrain.assemble import RIM, Terrain
from dav_gswt.terrain.backdrop import Backdrop

SLOPES = 1.5  # how much further than on level ground a ray may go above the surface
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


def reaching(terrain: Terrain, camera: Camera, box: Box) -> Box:
    """The ground whose Gaussians may show over a box: things before it, and what lies lower behind it."""
    ahead = camera.forward
    per_height = SLOPES * ahead[:2] / abs(ahead[2])
    ends = [box + per_height * -max(terrain.z[1], 0.0), box + per_height * max(-terrain.z[0], 0.0), box]
    return np.stack([np.min(ends, (0, 1)), np.max(ends, (0, 1))])


def near_box(field: Field, corner: Float[Array, "_"], box: Box) -> Field:
    """Gaussians of which some part lies over a box."""
    x, y = field.means[:, 0] + corner[0], field.means[:, 1] + corner[1]
    reach = RIM * np.exp(field.log_scales.max(1, initial=-np.inf))
    (west, south), (east, north) = box
    return field[(x + reach > west) & (x - reach < east) & (y + reach > south) & (y - reach < north)]


def of_terrain(terrain: Terrain, camera: Camera, box: Box) -> list[Piece]:
    """What of the terrain may show over a box, cell by cell from back to front."""
    eye, side, found = camera.centre, terrain.side, []
    cells = assemble.visible(terrain, camera)
    active = assemble.active(terrain, cells)
    for k in range(len(cells)):
        i, j, tile = int(cells.i[k]), int(cells.j[k]), int(cells.tile[k])
        corner = np.array([i * side, j * side, 0.0])
        levels = np.flatnonzero(active[:, k])
        parts = {int(level): near_box(terrain.tiles[level, tile], corner, box) for level in levels}
        if any(len(part) for part in parts.values()):
            direction = assemble.along(terrain, i, j, tile, eye)
            found.append(Piece(parts, corner, direction, bool(cells.close[k]), (i, j)))
    return found


def of_patch(levels: list[Field], corner: Float[Array, "3"], like: Piece, change: Float[Array, "4"], box: Box) -> Piece:
    """The exemplar with its corner there, where it may show over a box; colours and heights changed throughout."""
    parts = {}
    for level in like.parts:
        part = near_box(levels[min(level, len(levels) - 1)], corner, box)  # coarser ones are the tiles' own
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
    none = [splats.NONE, *(np.zeros((0, 3), np.float32) for _ in looks)]
    far, close = [none], [none]
    for piece in pieces:
        field, slope = assemble.placed(terrain, piece.parts, piece.corner, piece.direction, eye)
        part, which = splats.indexed(behind.over(field), slope, here, terrain.near)
        (close if piece.close else far).append([part, *(look(field, eye)[which] for look in looks)])
    far, close = ([splats.joined([g[0] for g in group]), *_columns(group)] for group in (far, close))
    last = splats.by_depth(close[0])
    stand, *colours = [splats.joined([far[0], close[0][last]])] + [
        np.concatenate([a, b[last]]) for a, b in zip(far[1:], close[1:], strict=True)
    ]
    seen = splats.blended(stand, here)
    picture = np.clip(seen.colour + (1 - seen.alpha)[..., None] * behind.seen_along(here.rays()[1]), 0, 1)
    return [picture, *(splats.blended(replace(stand, colours=own), here).colour for own in colours)]


def _columns(group: list[list]) -> list[Float32[Array, "n 3"]]:
    return [np.concatenate(own) for own in list(zip(*group, strict=True))[1:]]
