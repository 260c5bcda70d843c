"""Photos in any number and size: renders of a finished field, as photos of new ground would take hours to render."""

from pathlib import Path

import numpy as np

from dav_gswt import raster
from dav_gswt.field import GaussianField
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.synthetic.scene import FIELD_OF_VIEW

LOWEST = 40.0  # degrees: elevation of the lowest photo
SHADE = 0.5  # grey behind the field


def place_cameras(frame: SceneFrame, count: int, size: int) -> list[Camera]:
    """So many cameras, evenly around and above the exemplar, of square pictures."""
    places = camera_layouts.hemisphere(count, LOWEST, frame.flying_height)
    return [camera_layouts.orbit(*place, tuple(frame.exemplar.centre), size, size, FIELD_OF_VIEW) for place in places]


def photo_name(number: int) -> str:
    return f"photo_{number:04d}.png"


def render_photos(field: GaussianField, frame: SceneFrame, count: int, size: int, folder: Path | str) -> None:
    """Write the photos of `place_cameras`, as 8-bit PNG."""
    for number, camera in progress(list(enumerate(place_cameras(frame, count, size))), "render photos"):
        seen = raster.render(field, camera, background=SHADE)
        image_files.write_png(Path(folder) / photo_name(number), np.clip(seen.colour, 0, 1))
