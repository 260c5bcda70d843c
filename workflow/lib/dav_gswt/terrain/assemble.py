"""The endless terrain as one field for one camera: the tiles in sight, each at the level its distance asks for."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.field import Field, joined
from dav_gswt.terrain.choice import tile_at
from dav_gswt.tiles.build import TileSet

REACH = 48  # tiles to the horizon at most: beyond it the ground proxy has the terrain's mean colour
MOST = 10_000_000  # Gaussians in one picture


@dataclass(frozen=True)
class Terrain:
    """A tile set ready to be laid: fields by level and tile number, and how far each level is used."""

    tiles: dict[tuple[int, int], Field]  # (level, tile number), positions in [0, side]
    side: float
    distances: list[float]  # level l is used nearer than distances[l]; the last is infinite
    variants: int
    salt: int


def of_tiles(tiles: TileSet, manifest: dict) -> Terrain:
    """A tile set laid as a bundle's manifest says."""
    fields = {(level, tile): f for level, row in enumerate(tiles.fields) for tile, f in enumerate(row)}
    far = [np.inf if level["distance"] is None else level["distance"] for level in manifest["levels"]]
    return Terrain(fields, tiles.side, far, tiles.variants, manifest["salt"])


def visible(terrain: Terrain, camera: Camera) -> list[tuple[int, int, int]]:
    """Cells (i, j) that the camera may see, with their level, nearest first."""
    eye, side = camera.centre, terrain.side
    i0, j0 = int(np.floor(eye[0] / side)), int(np.floor(eye[1] / side))
    found = []
    for j in range(j0 - REACH, j0 + REACH + 1):
        for i in range(i0 - REACH, i0 + REACH + 1):
            corners = np.array([[x, y, z] for x in (i, i + 1) for y in (j, j + 1) for z in (-0.2, 0.2)], float) * [
                side,
                side,
                side,
            ]
            pixel, depth = camera.project(corners)
            ahead = depth > 0.01 * side
            if not ahead.any():
                continue
            outside = (pixel[ahead] < [-0.2 * camera.width, -0.2 * camera.height]).all(0) | (
                pixel[ahead] > [1.2 * camera.width, 1.2 * camera.height]
            ).all(0)
            if ahead.all() and outside.any():
                continue
            nearest = np.clip(eye[:2] / side, [i, j], [i + 1, j + 1]) * side
            distance = float(np.linalg.norm([*(nearest - eye[:2]), eye[2]]))
            found.append((distance, i, j))
    found.sort()
    level = [int(np.searchsorted(terrain.distances[:-1], d, side="right")) for d, _, _ in found]
    return [(i, j, lv) for (_, i, j), lv in zip(found, level, strict=True)]


def laid(terrain: Terrain, cells: list[tuple[int, int, int]], about: Float[Array, "3"]) -> Field:
    """The Gaussians of cells, placed relative to `about`: kilometres out float32 still resolves a disc.

    Tiles past MOST Gaussians are left out, farthest first.
    """
    parts, count = [], 0
    for i, j, level in cells:
        tile = terrain.tiles[level, tile_at(i, j, terrain.salt, terrain.variants)]
        if (count := count + len(tile)) > MOST:
            break
        offset = np.array([i * terrain.side - about[0], j * terrain.side - about[1], -about[2]], np.float32)
        parts.append(replace(tile, means=tile.means + offset))
    return joined(parts)
