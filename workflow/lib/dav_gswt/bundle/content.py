"""What a bundle is made of: a tile set for each material, objects, and the sun whose light is in the colours."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle.land_cover import ASSUMED_SUN, ClassesEntry, LightEntry, ScatterEntry, WaveEntry
from dav_gswt.bundle.manifest import ONLY_MATERIAL
from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.materials.model import MaterialInfo, ObjectLevels
from dav_gswt.materials.store import read_report
from dav_gswt.tiles.build import Recipe, TileSet
from dav_gswt.tiles.periods import measure_turn


@dataclass(frozen=True)
class BundleContent:
    """Tiles, materials and objects of a terrain.

    Attributes:
        tiles: of each material, all of the same size and number.
        materials: in the order of their tiles.
        objects: may be none.
        classes: which material lies where; needed with several materials (`terrain.fit_cover`).
        scatter: where objects stand, and the probability of each; needed with objects.
        variation: large-scale light and dark (`terrain.fit_variation`); None: none.
    """

    tiles: list[TileSet]
    materials: list[MaterialInfo]
    objects: list[ObjectLevels] = field(default_factory=list)
    classes: ClassesEntry | None = None
    scatter: ScatterEntry | None = None
    probabilities: list[float] = field(default_factory=list)
    variation: list[WaveEntry] | None = None

    @classmethod
    def of_one_material(cls, tiles: TileSet) -> "BundleContent":
        """One tile set, without objects."""
        colour = compute_ground_colour(tiles.fields[-1])
        return cls([tiles], [MaterialInfo(ONLY_MATERIAL, 1.0, tiles.side, colour, None)])

    @property
    def side(self) -> float:
        return self.tiles[0].side

    @property
    def spacing(self) -> float:
        return self.tiles[0].spacing

    @property
    def levels(self) -> int:
        return len(self.tiles[0].fields)

    @property
    def recipes(self) -> list[Recipe]:
        """Of all materials' tiles; none if any is known by its Gaussians alone."""
        found = [tiles.recipe for tiles in self.tiles if tiles.recipe is not None]
        return found if len(found) == len(self.tiles) else []

    def tile_fields(self, level: int) -> list[GaussianField]:
        """All tiles of a level by number, those of the first material first."""
        return [each for tiles in self.tiles for each in tiles.fields[level]]

    def object_fields(self, level: int) -> list[GaussianField]:
        """All objects at a level, as they are stored: in the middle of a tile."""
        middle = np.array([0.5 * self.side, 0.5 * self.side, 0], np.float32)
        return [replace(each.fields[level], means=each.fields[level].means + middle) for each in self.objects]

    def ground_height(self, material: int) -> float:
        """Mean z of a material's ground discs at the finest level; 0 without any."""
        heights = [f.means[f.ground, 2].astype(float) for f in self.tiles[material].fields[0]]
        flat = np.concatenate(heights)
        return float(flat.mean()) if len(flat) else 0.0

    def ground_colour(self) -> list[float]:
        """Mean colour of the ground of all materials, by their shares."""
        colours = [compute_ground_colour(tiles.fields[-1]) for tiles in self.tiles]
        shares = np.array([material.share for material in self.materials])
        return np.clip(shares @ np.array(colours) / shares.sum(), 0, 1).tolist()


def compute_ground_colour(fields: list[GaussianField]) -> list[float]:
    """Mean colour of the ground, or of all splats where none is ground."""
    ground = [f.base_colours[f.ground] for f in fields if f.ground.any()] or [f.base_colours for f in fields]
    return np.clip(np.concatenate(ground).astype(float).mean(0), 0, 1).tolist()


def find_light(frame: SceneFrame, materials: Path | str | None, seams: Mapping[str, Any]) -> LightEntry:
    """The captured sun in the frame of the tiles; an assumed one if neither EXIF nor relief reveals it.

    EXIF gives an azimuth from true north, relief an azimuth from the world's +y. The world is turned against north if
    GPS is known, and tiles of regular ground are turned against the world.

    Args:   materials: the folder of rule `find_materials`; None: the scene has none. seams: the report of the first
            material's tiles, whose turn counts.
    Raises: InputError: see `materials.store.read_report`.
    """
    pattern = seams.get("pattern")
    turn = measure_turn(np.array(pattern["turn"]))[0] if pattern else 0.0
    north = round((frame.georeference.north if frame.georeference else 0.0) - turn, 2) % 360
    if frame.sun and frame.georeference:
        return LightEntry(frame.sun.elevation, round(frame.sun.azimuth - north, 2) % 360, "exif", north)
    if materials and (sun := read_report(materials).sun):
        return LightEntry(sun.elevation, round(sun.azimuth + turn, 2) % 360, "relief", north)
    elevation, azimuth = ASSUMED_SUN
    return LightEntry(elevation, round(azimuth - north, 2) % 360, "assumed", north)
