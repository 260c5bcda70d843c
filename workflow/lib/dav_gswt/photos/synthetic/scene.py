"""Synthetic scenes: made from a family and a seed, and photographed with exact cameras by mitsuba.

The world is in metres, z up, the mean ground of the exemplar at z = 0; cameras are COLMAP's. Everything reflects
diffusely, under a sun and a sky, with one exposure a scene. Same scene, camera and samples: same bytes, on any number
of threads (a box filter, so that no pixel is summed from two blocks); with a compiled variant of mitsuba, which one has
to ask for (`variant`), up to the noise.
"""

import zlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square
from dav_gswt.photos.synthetic import camera_layouts, desert, flowers, grass, meadow, planet, renderer

FAMILIES = {"desert": desert, "meadow": meadow, "flowers": flowers, "grass": grass, "planet": planet}
EXEMPLAR = 6.0  # metres: side of the square of ground that the pictures are about
RADIUS = 7.0  # metres from the middle of the ground to the cameras
FIELD_OF_VIEW = 55.0  # degrees across the picture's width: 7.3 m of ground from straight above
RING_ELEVATION = 65.0  # degrees: neighbours of the start ring overlap by most of the exemplar
LOWEST_ELEVATION = 30.0  # degrees: the lowest candidate and test view, where a scene does not say
CIRCLE_ELEVATION = 45.0  # degrees, of the rig `paper`
OBLIQUE_ELEVATION = 45.0  # degrees, of the views that test how a field looks away from its photos
WALKERS = (0.8, 1.6, 3.2)  # metres above the mean ground: eye heights for stills and tests
WALKER_FIELD_OF_VIEW = 60.0  # degrees
NEAR = 0.01  # metres: mitsuba's rays start at this depth
SAMPLES = 20  # rays a pixel


@dataclass(frozen=True)
class Scene:
    """A synthetic world, told by few values; what is built from them is kept for the latest scene."""

    family: str
    seed: int
    options: desert.Options | meadow.Options | flowers.Options | grass.Options | planet.Options
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
        return {"zenith": encode(family.ZENITH).tolist(), "horizon": encode(family.HORIZON).tolist()}


def make(family: str, seed: int, **options) -> Scene:
    """A scene of a family.

    Raises: InputError: an unknown family, a negative seed, or an option that the family refuses.
    """
    if family not in FAMILIES:
        raise InputError(f"there is no synthetic family {family!r}; choose from {', '.join(FAMILIES)}")
    if seed < 0:
        raise InputError(f"{family}: seed is {seed!r}; it must be a whole number from 0")
    return Scene(family, seed, FAMILIES[family].options(**options))


def of_config(entry: dict) -> Scene:
    """The scene that an entry of the config's scenes describes."""
    return make(entry["family"], entry["seed"])


def start_views(entry: dict, middle=(0.0, 0.0, 0.0)) -> list[Camera]:
    """The cameras that the scene starts from, as the entry's `layout` says.

    ring: one straight above, the others around it. cap: spread evenly by area above the entry's lowest elevation.
    paper: some on a circle, the others as in a cap.
    """
    rig = entry.get("layout", "ring")
    if rig == "cap":
        places = camera_layouts.hemisphere(entry["photos"], _lowest(entry), RADIUS, turn=35.0)
    elif rig == "paper":
        places = camera_layouts.paper(entry["photos"], CIRCLE_ELEVATION, _lowest(entry), RADIUS)
    else:
        places = camera_layouts.start_ring(entry["photos"], RING_ELEVATION, RADIUS)
    return _cameras(places, middle, entry["size"])


def test_views(entry: dict, middle=(0.0, 0.0, 0.0)) -> list[Camera]:
    """The cameras that only test, group after group (`test_groups`)."""
    return [camera for group in _test_cameras(entry, middle).values() for camera in group]


def test_groups(entry: dict) -> dict[str, list[int]]:
    """Which of `test_views` belong together: a list of indices a group.

    The first group is spread over the cap from which photos may be taken: `hemisphere`, or `high` where the photos are
    taken by the rig `cap`. `oblique`: around at 45 degrees, and `walker`: from a walker's eye, if the entry has any.
    """
    found, count = {}, 0
    for name, cameras in _test_cameras(entry).items():
        found[name] = list(range(count, count + len(cameras)))
        count += len(cameras)
    return found


test_views.__test__ = test_groups.__test__ = False  # not tests, whatever their names make pytest think


def candidates(entry: dict, middle=(0.0, 0.0, 0.0)) -> list[Camera]:
    """The cameras that may be asked for."""
    return _cameras(camera_layouts.hemisphere(entry["candidates"], _lowest(entry), RADIUS), middle, entry["size"])


def walkers(entry: dict, middle=(0.0, 0.0, 0.0)) -> dict[str, Camera]:
    """Cameras for stills from a walker's eye, by name (`walker_1.6`): over the exemplar to the horizon, 16 : 9.

    They neither fit nor test. Each stands as far outside the exemplar as its eye is high, so that the nearest ground in
    the picture is the exemplar's.
    """
    width, rows = entry["size"], round(entry["size"] * 9 / 16)
    return {
        f"walker_{h:g}": camera_layouts.walker(h, 210.0, 0.5 * EXEMPLAR + h, middle, width, rows, WALKER_FIELD_OF_VIEW)
        for h in WALKERS
    }


def _lowest(entry: dict) -> float:
    return float(entry.get("min_elevation", LOWEST_ELEVATION))


def _test_cameras(entry: dict, middle=(0.0, 0.0, 0.0)) -> dict[str, list[Camera]]:
    all_over = "high" if entry.get("layout") == "cap" else "hemisphere"
    size, count = entry["size"], entry.get("walkers", 0)
    groups = {all_over: _cameras(camera_layouts.test_views(entry["test"], _lowest(entry), RADIUS), middle, size)}
    if entry.get("oblique"):
        around = camera_layouts.ring(entry["oblique"], OBLIQUE_ELEVATION, camera_layouts.NEARER * RADIUS, turn=20.0)
        groups["oblique"] = _cameras(around, middle, size)
    if count:
        heights = [WALKERS[i % len(WALKERS)] for i in range(count)]
        stands = [(h, 10.0 + 360.0 * i / count, 0.5 * EXEMPLAR + h) for i, h in enumerate(heights)]
        groups["walker"] = [camera_layouts.walker(*stand, middle, size, size, WALKER_FIELD_OF_VIEW) for stand in stands]
    return groups


def _cameras(places: list[camera_layouts.Place], middle, size: int) -> list[Camera]:
    return [camera_layouts.orbit(*place, middle, size, size, FIELD_OF_VIEW) for place in places]


def render(scene: Scene, camera: Camera, samples: int = SAMPLES, again: int = 0) -> Float32[Array, "h w 3"]:
    """A photo: sRGB-encoded, in [0, 1].

    Args:   samples: rays a pixel; taken up to the next number that a grid of strata can hold. again: which of several
            photos from one place, each with noise of its own.
    Raises: ValueError: a camera that mitsuba cannot hold (see `sensor`).
    """
    mi, world = renderer.use(), _world(scene)
    view = mi.load_dict(sensor(camera, {"type": "multijitter", "sample_count": samples}))
    light = mi.render(world, sensor=view, spp=view.sampler().sample_count(), seed=_noise_seed(scene, camera, again))
    return encode(np.array(light, np.float32)[..., :3])


def render_depth(scene: Scene, camera: Camera) -> Float32[Array, "h w"]:
    """Depth (camera z) along the ray through every pixel's centre; infinite where the sky is seen."""
    return _depth(_world(scene), camera)


def render_alone(scene: Scene, camera: Camera) -> dict[str, Float32[Array, "h w"]]:
    """Depths as `render_depth` gives them, of the `ground` alone and, if there are any, of the `stones` alone.

    Things that are strewn as instances are not among them.
    """
    return {name: _depth(part, camera) for name, part in _alone(scene).items()}


def _depth(world, camera: Camera) -> Float32[Array, "h w"]:
    mi = renderer.use()
    view = mi.load_dict(sensor(camera, {"type": "stratified", "sample_count": 1, "jitter": False}))
    # not mitsuba's map of depths beside the picture (`aov`): that lists all shapes anew for every pixel
    integrator = mi.load_dict({"type": "depth", "block_size": 16})
    distance = np.array(mi.render(world, sensor=view, integrator=integrator, spp=1), np.float64)[..., 0]
    steps = np.linalg.norm(camera.rays()[1], axis=-1)
    return np.where(distance > 0, NEAR + distance / steps, np.inf).astype(np.float32)


def encode(light: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Linear light to sRGB's curve (IEC 61966-2-1), clipped to [0, 1]."""
    light = np.clip(light, 0.0, 1.0)
    curve = 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curve).astype(light.dtype)


def sensor(camera: Camera, sampler: dict) -> dict:
    """mitsuba's description of a camera.

    mitsuba looks along +z with +x to the *left* of the picture and +y up: COLMAP's axes with x and y turned over. Its
    principal point offset is in widths (heights) of the picture, and grows as the principal point moves left (up).
    Raises: ValueError: an orthographic camera, or pixels that are not square.
    """
    mi = renderer.use()
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
        "to_world": mi.ScalarTransform4f(pose),
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
    """Other noise in every picture, by what is photographed, from where, and how often before."""
    place = np.round(np.concatenate([camera.centre, camera.forward]), 6) + 0.0  # + 0.0: no negative zeros
    return zlib.crc32(place.astype("<f8").tobytes(), (scene.seed + again * 0x9E3779B1) & 0xFFFFFFFF)


@lru_cache(maxsize=1)
def _world(scene: Scene):
    """The scene as mitsuba holds it: built once, for as many pictures as are taken of it."""
    renderer.use()
    from dav_gswt.photos.synthetic import world

    return world.build(FAMILIES[scene.family].grow(scene.options, scene.seed, scene.exemplar))


@lru_cache(maxsize=1)
def _alone(scene: Scene) -> dict:
    from dav_gswt.photos.synthetic import world

    return world.alone(_world(scene))
