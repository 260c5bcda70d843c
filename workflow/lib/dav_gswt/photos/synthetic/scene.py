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
    """The cameras of the start photos: one straight above, the others around it."""
    return orbit_cameras(camera_layouts.start_ring(entry["photo_count"], RING_ELEVATION, RADIUS), entry["size"])


def test_views(entry: dict) -> list[Camera]:
    """The cameras of the test photos: evenly by area over the cap of possible photos."""
    lowest = float(entry.get("min_elevation", LOWEST_ELEVATION))
    return orbit_cameras(camera_layouts.hemisphere(entry["test"], lowest, NEARER, turn=70.0), entry["size"])


def lens(size: int) -> Camera:
    """A camera with the lens and picture of all photos, wherever it stands."""
    return camera_layouts.orbit(90.0, 0.0, RADIUS, MIDDLE, size, size, FIELD_OF_VIEW)


def orbit_cameras(places: list[camera_layouts.Place], size: int) -> list[Camera]:
    """Cameras at places about the middle of the ground."""
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
