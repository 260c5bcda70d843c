"""The sun whose light is in the colours of a bundle: by the photos' EXIF, else by the shading of the relief."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle.land_cover import LightEntry
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.materials.store import read_report
from dav_gswt.tiles.periods import measure_turn


def find_light(frame: SceneFrame, materials: Path | str | None, seams: Mapping[str, Any]) -> LightEntry | None:
    """The captured sun, seen from the tiles; None where nothing tells it.

    EXIF's azimuth counts from north, that of relief from the world's +y, and tiles of regular ground are turned against
    the world.

    Args:   materials: the folder of rule `find_materials`; None: the scene has none. seams: the report of the first
            material's tiles, whose turn counts.
    Raises: InputError: see `materials.store.read_report`.
    """
    pattern = seams.get("pattern")
    turn = measure_turn(np.array(pattern["turn"]))[0] if pattern else 0.0
    if frame.sun and frame.georeference:
        sun, source, azimuth = frame.sun, "exif", frame.sun.azimuth - frame.georeference.north
    elif materials and (sun := read_report(materials).sun):
        source, azimuth = "relief", sun.azimuth
    else:
        return None
    return LightEntry(sun.elevation, round(azimuth + turn, 2) % 360, source)
