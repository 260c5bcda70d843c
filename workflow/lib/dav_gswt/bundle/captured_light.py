"""The sun whose light is in the colours of a bundle: from the photos' EXIF, else from the shading of the relief."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle.land_cover import ASSUMED_SUN, LightEntry
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.materials.store import read_report
from dav_gswt.tiles.periods import measure_turn


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
