"""Synthetic scenes: generated from a family and a seed, photographed with exact cameras by mitsuba.

The world is in metres, z up, the mean ground of the exemplar at z = 0; cameras are COLMAP's. All surfaces are diffuse,
lit by a sun and a sky, with one exposure per scene. The same scene, camera and samples give the same bytes on any
number of threads.
"""

import zlib
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.images.srgb import encode_srgb
from dav_gswt.photos.synthetic import desert, flowers, grass, meadow, oasis, planet

# each has a function `make_land`
FAMILIES: dict[str, ModuleType] = {
    "desert": desert,
    "meadow": meadow,
    "flowers": flowers,
    "grass": grass,
    "planet": planet,
    "oasis": oasis,
}
EXEMPLAR = 6.0  # metres: side of the square of ground that is photographed
RADIUS = 7.0  # metres from the middle of the ground to the cameras
NEARER = 0.9 * RADIUS  # of test views, so that they are distinct from all other views
FIELD_OF_VIEW = 55.0  # degrees across the picture's width: 7.3 m of ground from straight above
RING_ELEVATION = 65.0  # degrees: neighbours of the start ring overlap by most of the exemplar
LOWEST_ELEVATION = 30.0  # degrees: the lowest candidate and test view, where a scene does not say
SIDE_ELEVATION = 45.0  # degrees, of the circle of the layout `paper`, and of oblique test views
EYE_HEIGHTS = (0.8, 1.6, 3.2)  # metres above the mean ground, of tests at eye level
EYE_LEVEL_FIELD_OF_VIEW = 60.0  # degrees
SAMPLES = 20  # rays a pixel
MIDDLE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """A synthetic scene by its parameters. The mitsuba scene of the latest one is cached."""

    family: str
    seed: int

    @property
    def frame(self) -> SceneFrame:
        """Where the scene is, and from how far it is photographed."""
        half, reach = EXEMPLAR / 2, 1.25 * EXEMPLAR / 2
        exemplar, extent = Square(-half, -half, EXEMPLAR), Extent(-reach, -reach, reach, reach)
        return SceneFrame("synthetic", "metre", RADIUS, exemplar, extent)


def scene_from_config(entry: dict) -> Scene:
    """The scene of an entry of the config."""
    return Scene(entry["family"], entry["seed"])


def start_views(entry: dict) -> list[Camera]:
    """The cameras of the start photos, by the entry's `layout`.

    ring: one straight above, the others around it. cap: evenly by area above the entry's lowest elevation. paper: some
    on a circle, the others as in a cap.
    """
    layout = entry.get("layout", "ring")
    if layout == "cap":
        places = camera_layouts.hemisphere(entry["photo_count"], _lowest(entry), RADIUS, turn=35.0)
    elif layout == "paper":
        places = camera_layouts.paper(entry["photo_count"], SIDE_ELEVATION, _lowest(entry), RADIUS)
    else:
        places = camera_layouts.start_ring(entry["photo_count"], RING_ELEVATION, RADIUS)
    return _orbit_cameras(places, entry["size"])


def test_views(entry: dict) -> dict[str, list[Camera]]:
    """The cameras of the test photos in each group.

    The first group covers the cap of possible photos: `hemisphere`, or `high` with the layout `cap`. `oblique`: around
    at 45 degrees, and `walker`: at eye level, if the entry has any.
    """
    size, count = entry["size"], entry.get("walkers", 0)
    all_over = "high" if entry.get("layout") == "cap" else "hemisphere"
    places = camera_layouts.hemisphere(entry["test"], _lowest(entry), NEARER, turn=70.0)
    groups = {all_over: _orbit_cameras(places, size)}
    if entry.get("oblique"):
        around = camera_layouts.ring(entry["oblique"], SIDE_ELEVATION, NEARER, turn=20.0)
        groups["oblique"] = _orbit_cameras(around, size)
    if count:
        heights = [EYE_HEIGHTS[i % len(EYE_HEIGHTS)] for i in range(count)]
        stands = [(h, 10.0 + 360.0 * i / count, 0.5 * EXEMPLAR + h) for i, h in enumerate(heights)]
        groups["walker"] = [
            camera_layouts.eye_level_camera(*stand, MIDDLE, size, size, EYE_LEVEL_FIELD_OF_VIEW) for stand in stands
        ]
    return groups


def lens(size: int) -> Camera:
    """A camera with the lens and picture of all photos, wherever it stands."""
    return camera_layouts.orbit(90.0, 0.0, RADIUS, MIDDLE, size, size, FIELD_OF_VIEW)


def _lowest(entry: dict) -> float:
    return float(entry.get("min_elevation", LOWEST_ELEVATION))


def _orbit_cameras(places: list[camera_layouts.Place], size: int) -> list[Camera]:
    return [camera_layouts.orbit(*place, MIDDLE, size, size, FIELD_OF_VIEW) for place in places]


@lru_cache(maxsize=1)
def load_scene(scene: Scene):
    """The mitsuba scene, built once for all its pictures."""
    from dav_gswt.photos.synthetic import mitsuba_scene  # deferred: what only poses cameras renders nothing

    return mitsuba_scene.build_scene(FAMILIES[scene.family].make_land(scene.seed, EXEMPLAR))


def render(scene: Scene, camera: Camera, samples: int = SAMPLES) -> Float32[Array, "h w 3"]:
    """A photo by a pinhole with square pixels: sRGB-encoded, in [0, 1].

    samples: rays a pixel; taken up to the next number that a grid of strata can hold.
    """
    from dav_gswt.photos.synthetic import mitsuba_scene

    place = np.round(np.concatenate([camera.centre, camera.forward]), 6) + 0.0  # + 0.0: no negative zeros
    seed = zlib.crc32(place.astype("<f8").tobytes(), scene.seed & 0xFFFFFFFF)
    return encode_srgb(mitsuba_scene.render_light(load_scene(scene), camera, samples, seed))
