"""The endless terrain: a set of Wang tiles with everything that is needed to render it from any eye."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import TileSetInfo
from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField
from dav_gswt.raster.interface import RIM
from dav_gswt.terrain.heights import FlatSurface, HeightField, surface_from_config

NEAR = 0.1  # near plane, as a share of the eye floor


@dataclass(frozen=True)
class EndlessTerrain:
    """Tiles, level distances and the surface that they cover.

    tiles: by (level, tile number), positions in [0, side], in no order. switches, bands: distance at which a level
    gives way to the next, and half the width of that (see `weights.level_weights`); the last switch is infinite.
    directions: of the pre-sorted orders; tile_orders: indices of the directions that each tile keeps. z: range of
    heights of all Gaussians. overhang: largest extent of a Gaussian beyond the edge of its tile. near: distance of the
    near plane. smooth: smoothstep fades. reach: distance to the last tiles, in tile sides; beyond it the ground has
    the terrain's mean colour.
    """

    tiles: dict[tuple[int, int], GaussianField]
    side: float
    switches: list[float]
    bands: list[float]
    directions: Float[Array, "d 3"]
    tile_orders: list[list[int]]
    z: tuple[float, float]
    overhang: float
    variants: int
    salt: int
    near: float
    heights: HeightField = FlatSurface()
    smooth: bool = False
    reach: int = 48

    def height_range(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n"]]:
        """Lower and upper bound of the heights of all Gaussians in cells with these centres, the surface included."""
        half = (0.5 * self.side + self.overhang) * 2**0.5
        middle, _ = self.heights.at(x, y)
        most = self.heights.steepest * half
        low = np.maximum(middle - most, self.heights.low) + self.z[0]
        return low, np.minimum(middle + most, self.heights.high) + self.z[1]


def terrain_from_bundle(bundle: Bundle, surface: dict[str, Any]) -> EndlessTerrain:
    """The Gaussians of a bundle, as they were quantized, on the surface that the config's `heights` describes.

    Raises: InputError: see `bundle.chunks.read_chunk`, `heights.surface_from_config`.
    """
    return terrain_from_fields(bundle.fields(), bundle.manifest, surface)


def terrain_from_fields(
    tiles: list[list[GaussianField]], manifest: TileSetInfo, surface: dict[str, Any]
) -> EndlessTerrain:
    """tiles[level][tile] with the distances of a manifest, on the surface that the config's `heights` describes.

    Raises: InputError: as `heights.surface_from_config`.
    """
    levels, entries, side = manifest.levels, manifest.tiles, manifest.tile_side
    largest = max(float(np.exp(f.log_scales.max(initial=-np.inf))) for row in tiles for f in row)
    beyond = (RIM - 3) * largest  # the manifest's heights reach three deviations beyond the centres
    return EndlessTerrain(
        tiles={(level, tile): f for level, row in enumerate(tiles) for tile, f in enumerate(row)},
        side=side,
        switches=[np.inf if level.distance is None else level.distance for level in levels],
        bands=[level.band for level in levels],
        directions=np.array(manifest.directions, float),
        tile_orders=[entry.chunks[0].orders for entry in entries],
        z=(min(entry.z[0] for entry in entries) - beyond, max(entry.z[1] for entry in entries) + beyond),
        overhang=RIM * largest,
        variants=len(tiles[0]) // 16,
        salt=manifest.salt,
        near=NEAR * manifest.eye_floor,
        heights=surface_from_config(surface, side),
    )
