"""Synthetic scenes: generated from a family and a seed, photographed with exact cameras by mitsuba.

The world is in metres, z up, the mean ground of the exemplar at z = 0; cameras are COLMAP's. All surfaces are diffuse,
lit by a sun and a sky, with one exposure per scene. The same scene, camera and samples give the same bytes on any
number of threads (a box filter: no pixel is summed from two blocks); compiled variants of mitsuba (see `renderer`) give
the same up to noise.
"""

import zlib
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.photos.synthetic import desert, flowers, grass, land, meadow, oasis, planet, renderer
from dav_gswt.photos.synthetic.labels import GroundLabels

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
FIELD_OF_VIEW = 55.0  # degrees across the picture's width: 7.3 m of ground from straight above
RING_ELEVATION = 65.0  # degrees: neighbours of the start ring overlap by most of the exemplar
LOWEST_ELEVATION = 30.0  # degrees: the lowest candidate and test view, where a scene does not say
CIRCLE_ELEVATION = 45.0  # degrees, of the layout `paper`
OBLIQUE_ELEVATION = 45.0  # degrees, of the views that test how a field looks away from its photos
EYE_HEIGHTS = (0.8, 1.6, 3.2)  # metres above the mean ground, of tests at eye level
EYE_LEVEL_FIELD_OF_VIEW = 60.0  # degrees
NEAR = 0.01  # metres: near plane of mitsuba
SAMPLES = 20  # rays a pixel


@dataclass(frozen=True)
class Scene:
    """A synthetic scene by its parameters. The mitsuba scene of the latest one is cached."""

    family: str
    seed: int
    options: land.FamilyOptions
    exemplar: float = EXEMPLAR

    @property
    def frame(self) -> SceneFrame:
        """Where the scene is, and from how far it is photographed."""
        half = self.exemplar / 2
        reach = 1.25 * half
        exemplar, extent = Square(-half, -half, self.exemplar), Extent(-reach, -reach, reach, reach)
        return SceneFrame("synthetic", "metre", RADIUS, exemplar, extent)

    @property
    def sky(self) -> dict:
        """The sky's colours, sRGB in [0, 1]."""
        family = FAMILIES[self.family]
        return {"zenith": encode_srgb(family.ZENITH).tolist(), "horizon": encode_srgb(family.HORIZON).tolist()}


def make_scene(family: str, seed: int, **options) -> Scene:
    """A scene of a family.

    Raises: InputError: an unknown family, a negative seed, or an option that the family refuses.
    """
    if family not in FAMILIES:
        raise InputError(f"there is no synthetic family {family!r}; choose from {', '.join(FAMILIES)}")
    if seed < 0:
        raise InputError(f"{family}: seed is {seed!r}; it must be a whole number from 0")
    return Scene(family, seed, land.make_options(family, FAMILIES[family].Options, options))


def scene_from_config(entry: dict) -> Scene:
    """The scene of an entry of the config."""
    return make_scene(entry["family"], entry["seed"])


def start_views(entry: dict, middle=(0.0, 0.0, 0.0)) -> list[Camera]:
    """The cameras of the start photos, by the entry's `layout`.

    ring: one straight above, the others around it. cap: evenly by area above the entry's lowest elevation. paper: some
    on a circle, the others as in a cap.
    """
    layout = entry.get("layout", "ring")
    if layout == "cap":
        places = camera_layouts.hemisphere(entry["photos"], _lowest(entry), RADIUS, turn=35.0)
    elif layout == "paper":
        places = camera_layouts.paper(entry["photos"], CIRCLE_ELEVATION, _lowest(entry), RADIUS)
    else:
        places = camera_layouts.start_ring(entry["photos"], RING_ELEVATION, RADIUS)
    return _orbit_cameras(places, middle, entry["size"])


def test_views(entry: dict, middle=(0.0, 0.0, 0.0)) -> list[Camera]:
    """The cameras of the test photos, group after group (`test_groups`)."""
    return [camera for group in _test_cameras(entry, middle).values() for camera in group]


def test_groups(entry: dict) -> dict[str, list[int]]:
    """The indices of the `test_views` in each group.

    The first group covers the cap of possible photos: `hemisphere`, or `high` with the layout `cap`. `oblique`: around
    at 45 degrees, and `walker`: at eye level, if the entry has any.
    """
    found, count = {}, 0
    for name, cameras in _test_cameras(entry).items():
        found[name] = list(range(count, count + len(cameras)))
        count += len(cameras)
    return found


def lens(size: int) -> Camera:
    """A camera with the lens and picture of all photos, wherever it stands."""
    return camera_layouts.orbit(90.0, 0.0, RADIUS, (0.0, 0.0, 0.0), size, size, FIELD_OF_VIEW)


def _lowest(entry: dict) -> float:
    return float(entry.get("min_elevation", LOWEST_ELEVATION))


def _test_cameras(entry: dict, middle=(0.0, 0.0, 0.0)) -> dict[str, list[Camera]]:
    all_over = "high" if entry.get("layout") == "cap" else "hemisphere"
    size, count = entry["size"], entry.get("walkers", 0)
    groups = {all_over: _orbit_cameras(camera_layouts.held_out(entry["test"], _lowest(entry), RADIUS), middle, size)}
    if entry.get("oblique"):
        around = camera_layouts.ring(entry["oblique"], OBLIQUE_ELEVATION, camera_layouts.NEARER * RADIUS, turn=20.0)
        groups["oblique"] = _orbit_cameras(around, middle, size)
    if count:
        heights = [EYE_HEIGHTS[i % len(EYE_HEIGHTS)] for i in range(count)]
        stands = [(h, 10.0 + 360.0 * i / count, 0.5 * EXEMPLAR + h) for i, h in enumerate(heights)]
        groups["walker"] = [
            camera_layouts.eye_level_camera(*stand, middle, size, size, EYE_LEVEL_FIELD_OF_VIEW) for stand in stands
        ]
    return groups


def _orbit_cameras(places: list[camera_layouts.Place], middle, size: int) -> list[Camera]:
    return [camera_layouts.orbit(*place, middle, size, size, FIELD_OF_VIEW) for place in places]


def render(scene: Scene, camera: Camera, samples: int = SAMPLES, again: int = 0) -> Float32[Array, "h w 3"]:
    """A photo: sRGB-encoded, in [0, 1].

    Args:   samples: rays a pixel; taken up to the next number that a grid of strata can hold. again: which of several
            photos from one place, each with noise of its own.
    Raises: ValueError: a camera that mitsuba cannot hold (see `make_sensor`).
    """
    mi, world = renderer.load_mitsuba(), _load_scene(scene).world
    view = mi.load_dict(make_sensor(camera, {"type": "multijitter", "sample_count": samples}))
    light = mi.render(world, sensor=view, spp=view.sampler().sample_count(), seed=_noise_seed(scene, camera, again))
    return encode_srgb(np.array(light, np.float32)[..., :3])


def render_depth(scene: Scene, camera: Camera) -> Float32[Array, "h w"]:
    """Depth (camera z) along the ray through every pixel's centre; infinite where the sky is seen."""
    return _render_depth(_load_scene(scene).world, camera)


def render_isolated_depths(
    scene: Scene, camera: Camera, names: tuple[str, ...] = ("ground", "stones")
) -> dict[str, Float32[Array, "h w"]]:
    """Depths as of `render_depth`, of parts of the scene alone: those that it has of `ground`, `stones` and `objects`.

    objects: plants that are single objects (`labels`).
    """
    parts = _load_isolated(scene)
    return {name: _render_depth(parts[name], camera) for name in names if name in parts}


def load_labels(scene: Scene) -> GroundLabels | None:
    """The true materials and objects of the ground; None: the family has none."""
    return _load_scene(scene).labels


def _render_depth(world, camera: Camera) -> Float32[Array, "h w"]:
    mi = renderer.load_mitsuba()
    view = mi.load_dict(make_sensor(camera, {"type": "stratified", "sample_count": 1, "jitter": False}))
    # not mitsuba's map of depths beside the picture (`aov`): that lists all shapes anew for every pixel
    integrator = mi.load_dict({"type": "depth", "block_size": 16})
    distance = np.array(mi.render(world, sensor=view, integrator=integrator, spp=1), np.float64)[..., 0]
    steps = np.linalg.norm(camera.rays()[1], axis=-1)
    return np.where(distance > 0, NEAR + distance / steps, np.inf).astype(np.float32)


def encode_srgb(light: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Linear light to sRGB's curve (IEC 61966-2-1), clipped to [0, 1]."""
    light = np.clip(light, 0.0, 1.0)
    curve = 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curve).astype(light.dtype)


def make_sensor(camera: Camera, sampler: dict) -> dict:
    """The description of a camera for mitsuba.

    mitsuba looks along +z with +x to the *left* of the picture and +y up: COLMAP's axes with x and y turned over. Its
    principal point offset is in widths (heights) of the picture, and grows as the principal point moves left (up).
    Raises: ValueError: an orthographic camera, or pixels that are not square.
    """
    mi = renderer.load_mitsuba()
    if camera.orthographic or not np.isclose(camera.fx, camera.fy, rtol=1e-9):
        raise ValueError("synthetic scenes are photographed by pinhole cameras with square pixels")
    pose = np.eye(4)
    pose[:3, :3] = camera.rotation.T * [-1.0, -1.0, 1.0]
    pose[:3, 3] = camera.centre
    return {
        "type": "perspective",
        "fov_axis": "x",
        "fov": float(np.degrees(2 * np.arctan(0.5 * camera.width / camera.fx))),
        "near_clip": NEAR,
        "far_clip": 1e4,
        "principal_point_offset_x": 0.5 - camera.cx / camera.width,
        "principal_point_offset_y": 0.5 - camera.cy / camera.height,
        "to_world": mi.ScalarTransform4f(pose),  # pyright: ignore[reportCallIssue, reportArgumentType]: it takes arrays
        "sampler": sampler,
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
    }


def _noise_seed(scene: Scene, camera: Camera, again: int) -> int:
    """A seed of its own for every picture, by the scene, the camera, and `again`."""
    place = np.round(np.concatenate([camera.centre, camera.forward]), 6) + 0.0  # + 0.0: no negative zeros
    return zlib.crc32(place.astype("<f8").tobytes(), (scene.seed + again * 0x9E3779B1) & 0xFFFFFFFF)


class _LoadedScene(NamedTuple):
    """world, objects: mitsuba scenes, of everything and of the plants that are objects."""

    world: Any
    objects: Any
    labels: GroundLabels | None


@lru_cache(maxsize=1)
def _load_scene(scene: Scene) -> _LoadedScene:
    """The mitsuba scene, built once for all its pictures."""
    renderer.load_mitsuba()
    from dav_gswt.photos.synthetic import mitsuba_scene

    made = FAMILIES[scene.family].make_land(scene.options, scene.seed, scene.exemplar)
    return _LoadedScene(mitsuba_scene.build_scene(made), mitsuba_scene.build_objects(made), made.labels)


@lru_cache(maxsize=1)
def _load_isolated(scene: Scene) -> dict:
    from dav_gswt.photos.synthetic import mitsuba_scene

    loaded = _load_scene(scene)
    objects = {} if loaded.objects is None else {"objects": loaded.objects}
    return mitsuba_scene.isolate_shapes(loaded.world) | objects
