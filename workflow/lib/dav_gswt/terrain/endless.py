"""The endless terrain: a set of Wang tiles with everything that is needed to render it from any eye."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.land_cover import ObjectEntry
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField
from dav_gswt.raster.interface import RIM
from dav_gswt.terrain import heights
from dav_gswt.terrain.class_rules import NOISE, apply_rule, warn_of_missing
from dav_gswt.terrain.classes import Classes
from dav_gswt.terrain.heights import FlatSurface, HeightField
from dav_gswt.terrain.light import PlacedLight
from dav_gswt.terrain.scatter import Scatter
from dav_gswt.terrain.variation import Variation
from dav_gswt.tiles.layout import EDGES

NEAR = 0.1  # near plane, as a share of the eye floor


@dataclass(frozen=True)
class EndlessTerrain:
    """Tiles, level distances and the surface that they cover.

    tiles: by (level, tile number), positions in [0, side], in no order. switches, bands: distance at which a level
    gives way to the next (`manifest.compute_levels`), and half the width of that (see `draw_order.level_weights`); the
    last switch is infinite.
    directions: of the pre-sorted orders; tile_orders: indices of the directions that each tile keeps. z: range of
    heights of all Gaussians. overhang: largest extent of a Gaussian beyond the edge of its tile. variants: centres of a
    material's tiles. near: distance of the near plane. reach: distance to the last tiles, in tile sides; beyond it the
    ground has the terrain's mean colour. classes: which material lies where; None with one. objects:
    objects[number][level], about the foot. extents: of each object, the largest distance of a Gaussian's rim from the
    foot. scatter: where they stand; None without objects. variation: of colours, not on a sphere; None: none. light: of
    sun and sky around an eye; None: as captured.
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
    reach: int = 48
    classes: Classes | None = None
    objects: list[list[GaussianField]] = field(default_factory=list)
    extents: list[float] = field(default_factory=list)
    scatter: Scatter | None = None
    variation: Variation | None = None
    light: PlacedLight | None = None

    @property
    def object_entries(self) -> Sequence[ObjectEntry]:
        return self.scatter.objects if self.scatter is not None else []

    @property
    def tiles_each(self) -> int:
        """Number of tiles of a material."""
        return EDGES * self.variants


def terrain_from_bundle(
    bundle: Bundle, surface: dict[str, Any], rule: Sequence[dict[str, Any]] = NOISE
) -> EndlessTerrain:
    """The Gaussians of a bundle, as they were quantized, on the surface and with the classes of the config.

    Args:   surface: the config's `heights`. rule: the config's `classes`.
    Raises: InputError: see `bundle.store.Bundle.chunk`, `heights.surface_from_config`, `class_rules.apply_rule`.
    """
    manifest = apply_rule(bundle.manifest, rule)
    terrain = terrain_from_fields(bundle.fields(), manifest, surface, _read_objects(bundle))
    if terrain.classes is not None:
        warn_of_missing(terrain.classes, [material.name for material in manifest.materials])
    return terrain


def terrain_from_page(bundle: Bundle) -> EndlessTerrain:
    """The terrain of a page folder; of a bundle: on level ground, with the classes of its own noise.

    Raises: InputError: see `bundle.store.Bundle.chunk`; a height map that is missing or damaged.
    """
    manifest = bundle.manifest
    surface = heights.read_surface(bundle.folder, manifest.heights or {"kind": "flat"}, manifest.tile_side)
    return terrain_from_fields(bundle.fields(), manifest, surface, _read_objects(bundle))


def _read_objects(bundle: Bundle) -> list[list[GaussianField]]:
    levels, objects = range(len(bundle.manifest.levels)), range(len(bundle.manifest.objects or []))
    return [[bundle.object_chunk(number, level) for level in levels] for number in objects]


def terrain_from_fields(
    tiles: list[list[GaussianField]],
    manifest: Manifest,
    surface: dict[str, Any] | HeightField,
    objects: Sequence[list[GaussianField]] = (),
) -> EndlessTerrain:
    """tiles[level][tile] with the distances and classes of a manifest, on a surface.

    Args:   surface: or the config's `heights` that describes it. objects: objects[number][level], about their feet.
    Raises: InputError: as `heights.surface_from_config`, `heights.require_plain_cover`.
    """
    levels, entries, side = manifest.levels, manifest.tiles, manifest.tile_side
    largest = max(float(np.exp(f.log_scales.max(initial=-np.inf))) for row in tiles for f in row)
    surface = heights.surface_from_config(surface, side, manifest.eye_floor) if isinstance(surface, dict) else surface
    heights.require_plain_cover(surface, manifest.classes, manifest.objects)
    classes = manifest.classes and Classes(manifest.classes, len(manifest.materials), side, surface)
    beyond = (RIM - 3) * largest  # the manifest's heights reach three deviations beyond the centres
    extents, things = [], manifest.objects or []
    for fields in objects:
        reach = [RIM * np.exp(f.log_scales.astype(float)).max(1) for f in fields]
        away = [np.linalg.norm(f.means.astype(float), axis=1) + r for f, r in zip(fields, reach, strict=True)]
        extents.append(float(np.concatenate(away).max(initial=0.0)))
    z = [(entry.z[0] - beyond, entry.z[1] + beyond) for entry in entries]
    scatter, widest = None, 0.0
    if manifest.scatter is not None:
        scatter, most = Scatter(manifest.scatter, things, side, classes), 1 + manifest.scatter.size
        reach = [most * extent for extent in extents]
        z += [(each.ground - r, each.ground + r) for each, r in zip(things, reach, strict=True)]
        widest = max(reach)
    return EndlessTerrain(
        tiles={(level, tile): f for level, row in enumerate(tiles) for tile, f in enumerate(row)},
        side=side,
        switches=[np.inf if level.distance is None else level.distance for level in levels],
        bands=[level.band for level in levels],
        directions=np.array(manifest.directions, float),
        tile_orders=[entry.orders for entry in entries],
        z=(min(low for low, _ in z), max(high for _, high in z)),
        overhang=max(RIM * largest, widest),
        variants=len(tiles[0]) // (16 * len(manifest.materials)),
        salt=manifest.salt,
        near=NEAR * manifest.eye_floor,
        heights=surface,
        classes=classes,
        objects=list(objects),
        extents=extents,
        scatter=scatter,
        variation=Variation(manifest.variation, side, manifest.salt) if manifest.variation else None,
    )
