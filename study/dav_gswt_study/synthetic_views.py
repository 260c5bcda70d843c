"""From where the study's synthetic scenes are photographed and tested, beside what the product does."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.camera_layouts import Place
from dav_gswt.geometry.cameras import Camera, pinhole
from dav_gswt.photos.synthetic import scene
from dav_gswt.photos.synthetic.scene import EXEMPLAR, LOWEST_ELEVATION, NEARER, RADIUS

SIDE_ELEVATION = 45.0  # degrees, of the circle of the layout `paper`, and of oblique test views
CIRCLE = 36  # views on that circle, of 100 or of any number from 72
EYE_HEIGHTS = (0.8, 1.6, 3.2)  # metres above the mean ground, of tests at eye level
EYE_LEVEL_PITCH, EYE_LEVEL_FIELD_OF_VIEW = 12.0, 60.0  # degrees: below the horizon; across the picture


def place_start_views(entry: Mapping[str, Any], layout: str) -> list[Camera]:
    """The cameras of the start photos. entry: of the scene in the config.

    layout: `ring`, as the product has them; `cap`, evenly by area above the entry's lowest elevation; `paper`, some on
    a circle, the others as in a cap.
    """
    count, lowest = entry["photo_count"], float(entry.get("min_elevation", LOWEST_ELEVATION))
    if layout == "ring":
        return scene.start_views(dict(entry))
    if layout == "cap":
        places = camera_layouts.hemisphere(count, lowest, RADIUS, turn=35.0)
    else:
        places = list_paper_places(count, SIDE_ELEVATION, lowest, RADIUS)
    return scene.orbit_cameras(places, entry["size"])


def place_test_views(entry: Mapping[str, Any], layout: str, oblique: int, walkers: int) -> dict[str, list[Camera]]:
    """The cameras of the test photos in each group.

    The first group covers the cap of possible photos: `hemisphere`, or `high` with the layout `cap`. `oblique`: so many
    around at 45 degrees, and `walker`: at eye level.
    """
    groups = {"high" if layout == "cap" else "hemisphere": scene.test_views(dict(entry))}
    if oblique:
        around = camera_layouts.ring(oblique, SIDE_ELEVATION, NEARER, turn=20.0)
        groups["oblique"] = scene.orbit_cameras(around, entry["size"])
    if walkers:
        heights = [EYE_HEIGHTS[i % len(EYE_HEIGHTS)] for i in range(walkers)]
        stands = [(h, 10.0 + 360.0 * i / walkers, 0.5 * EXEMPLAR + h) for i, h in enumerate(heights)]
        groups["walker"] = [stand_at_eye_level(*stand, scene.MIDDLE, entry["size"]) for stand in stands]
    return groups


def list_paper_places(n: int, elevation: float, lowest_elevation: float, radius: float) -> list[Place]:
    """n places as in the paper: a circle at `elevation`, the others uniform by area above `lowest_elevation`.

    On the circle are 36, or 36 in 100 where n is below 72.
    """
    circle = CIRCLE if n >= 2 * CIRCLE else round(n * CIRCLE / 100)
    others = camera_layouts.hemisphere(n - circle, lowest_elevation, radius, turn=35.0)
    return camera_layouts.ring(circle, elevation, radius) + others


def stand_at_eye_level(height: float, azimuth: float, away: float, target, size: int) -> Camera:
    """A camera at eye level: `height` above the target, `away` from it, looking past it to the horizon.

    azimuth: of the camera from the target. size: of its square picture.
    """
    a, down = np.radians(azimuth), np.radians(EYE_LEVEL_PITCH)
    out = np.array([np.cos(a), np.sin(a), 0.0])
    eye = np.asarray(target, float) + away * out + [0.0, 0.0, height]
    ahead = eye - np.cos(down) * out - [0.0, 0.0, np.sin(down)]
    return pinhole(eye, ahead, size, size, EYE_LEVEL_FIELD_OF_VIEW)
