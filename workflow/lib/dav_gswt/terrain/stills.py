"""Stills of the endless terrain: rendered tile by tile as the viewer does, over a sky and a far ground."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest, Sky
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain import splats, visibility
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.choice import Vector
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import Sphere
from dav_gswt.terrain.light import Light, light_of, place_light
from dav_gswt.terrain.placement import group_by_cell, place_cell
from dav_gswt.terrain.planet import frame_at, place_on_sphere, visible_on_sphere, walk_from
from dav_gswt.threads import default_threads

MAX_GAUSSIANS = 10_000_000  # in one picture
ORBIT = 2.5  # height of `above` over a planet, in its radii: all of it is in view
START = (20.0, 30.0)  # longitude and latitude that places on a sphere count from, in degrees


@dataclass(frozen=True)
class Shot:
    """Viewpoint of a still: position in tiles, height above the surface in eye floors, viewing direction."""

    name: str
    at: tuple[float, float]  # tiles
    height: float  # eye floors
    pitch: float  # degrees below the horizon
    yaw: float  # degrees from east


SHOTS = (
    Shot("walker", (0.5, 0.5), 1.0, 12.0, 60.0),
    Shot("oblique", (3.3, 2.2), 3.0, 35.0, 20.0),
    Shot("above", (-4.0, 5.0), 12.0, 90.0, 90.0),
)


def list_shots(terrain: EndlessTerrain, floor: float) -> list[Shot]:
    """The stills of a terrain; on a sphere `above` is the view from an orbit. floor: lowest height of the eye."""
    if not isinstance(terrain.heights, Sphere):
        return list(SHOTS)
    high = ORBIT * terrain.heights.radius / floor
    return [replace(shot, height=high) if shot.pitch == 90 else shot for shot in SHOTS]


def shot_camera(shot: Shot, terrain: EndlessTerrain, floor: float, width: int, height: int) -> Camera:
    """The camera of a shot, with a horizontal field of view of 60 degrees. floor: lowest height of the eye."""
    if isinstance(sphere := terrain.heights, Sphere):
        axes = walk_from(frame_at(*START), np.array(shot.at) * terrain.side, sphere.radius)
        eye = (sphere.radius + shot.height * floor) * axes[2]
        return camera_on(eye, axes, shot.yaw, -min(shot.pitch, 89.99), width, height)
    x, y = (v * terrain.side for v in shot.at)
    ground, _ = terrain.heights.at(np.array([x]), np.array([y]))
    eye = np.array([x, y, ground[0] + shot.height * floor])
    down, yaw = np.radians(min(shot.pitch, 89.99)), np.radians(shot.yaw)
    ahead = np.array([np.cos(down) * np.cos(yaw), np.cos(down) * np.sin(yaw), -np.sin(down)])
    return cameras.pinhole(eye, eye + ahead, width, height, 60.0)


def camera_on(eye: Vector, axes: Float[Array, "3 3"], yaw: float, pitch: float, width: int, height: int) -> Camera:
    """The camera of an eye with a horizontal field of view of 60 degrees.

    Args:   axes: east, north and up. yaw: degrees from east to the left. pitch: degrees above the level, over -90.
    """
    up, turn = np.radians(pitch), np.radians(yaw)
    ahead = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    here = cameras.pinhole(np.zeros(3), ahead, width, height, 60.0)
    rotation = here.rotation @ axes
    return replace(here, rotation=rotation, translation=-rotation @ eye)


def render_shot(
    terrain: EndlessTerrain, shot: Shot, manifest: Manifest, width: int, height: int
) -> Float32[Array, "h w 3"]:
    """Render a shot with the eye floor, sky and ground colour of the bundle's manifest."""
    camera = shot_camera(shot, terrain, manifest.eye_floor, width, height)
    return render_view(terrain, camera, manifest.sky, manifest.ground_colour, light=light_of(manifest))


def render_view(
    terrain: EndlessTerrain,
    camera: Camera,
    sky: Sky,
    ground_colour: Sequence[float] | Array,
    exact: bool = False,
    light: Light | None = None,
) -> Float32[Array, "h w 3"]:
    """Render the terrain; pixels that no tile covers show the sky above the horizon and the far ground below it.

    Tiles are drawn back to front, each in a pre-sorted order; the 3 x 3 block about the eye is drawn last and sorted by
    depth.

    Args:   exact: sort all Gaussians together by depth, as a reference. light: of sun and sky; None: as captured.
    Raises: ValueError: an orthographic camera, whose rays have no common origin.
    """
    if camera.orthographic:
        raise ValueError("the terrain is drawn for a pinhole camera")
    eye, here, surface = camera.centre, replace(camera, translation=np.zeros(3)), terrain.heights
    if light and not isinstance(surface, Sphere):
        terrain = replace(terrain, light=place_light(light, surface, terrain.side, eye))
    sphere = surface if isinstance(surface, Sphere) else None
    cells = visible_on_sphere(terrain, sphere, camera) if sphere else visibility.visible_cells(terrain, camera)
    terrain = visibility.coarsen_to_budget(terrain, camera, MAX_GAUSSIANS, cells)
    things = group_by_cell(terrain, cells, eye)
    backdrop = Backdrop.for_eye(terrain, eye, sky, ground_colour)

    def project(k: int) -> splats.Splats:
        if sphere:
            field, slope = place_on_sphere(terrain, sphere, cells[k : k + 1], eye)
        else:
            field, slope = place_cell(terrain, cells[k : k + 1], eye, things.get(k))
        return splats.project(backdrop.blend_far(field, slope), slope, here, terrain.near)[0]

    far, close = [splats.EMPTY], [splats.EMPTY]
    with ThreadPoolExecutor(default_threads()) as pool:  # NumPy works beside itself; each cell is on its own
        for k, part in enumerate(pool.map(project, range(len(cells)))):
            (close if exact or cells.close[k] else far).append(part)
    last = splats.Splats.concatenate(close)
    seen = splats.blend(splats.Splats.concatenate([*far, last[splats.depth_order(last)]]), here)
    return np.clip(seen.colour + (1 - seen.alpha)[..., None] * backdrop.show(here.rays()[1]), 0, 1)
