"""Pictures of the endless terrain, drawn tile by tile as the page draws it, over a sky and a far ground."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.terrain import splats
from dav_gswt.terrain.assemble import MOST, Terrain, coarsened, laid, sizes, visible, within_budget
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.meter import Meter


@dataclass(frozen=True)
class Shot:
    """A still to take: where the eye is, in tiles and, above the surface there, in eye floors, and how it looks."""

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


def flight(frames: int, length: float, height: float) -> list[Shot]:
    """A walk straight on from the walker's place, `length` tiles long, always so many eye floors above the surface."""
    walker = SHOTS[0]
    yaw = np.radians(walker.yaw)
    way = np.linspace(0, length, frames)[:, None] * [np.cos(yaw), np.sin(yaw)] + walker.at
    return [replace(walker, name=f"{k:04d}", at=tuple(at), height=float(height)) for k, at in enumerate(way.tolist())]


def camera_of(shot: Shot, terrain: Terrain, floor: float, width: int, height: int) -> Camera:
    """The shot's camera, 60 degrees wide."""
    x, y = (v * terrain.side for v in shot.at)
    ground, _ = terrain.heights.at(np.array([x]), np.array([y]))
    eye = np.array([x, y, ground[0] + shot.height * floor])
    down, yaw = np.radians(min(shot.pitch, 89.99)), np.radians(shot.yaw)
    ahead = np.array([np.cos(down) * np.cos(yaw), np.cos(down) * np.sin(yaw), -np.sin(down)])
    return cameras.pinhole(eye, eye + ahead, width, height, 60.0)


def taken(terrain: Terrain, shot: Shot, manifest: dict, width: int, height: int) -> Float32[Array, "h w 3"]:
    """A shot's picture, with the eye floor, the sky and the far ground of the bundle's manifest."""
    camera = camera_of(shot, terrain, manifest["eye_floor"], width, height)
    return draw(terrain, camera, manifest["sky"], manifest["ground_colour"])


def draw(
    terrain: Terrain,
    camera: Camera,
    sky: dict,
    ground_colour,
    exact: bool = False,
    meter: Meter | None = None,
) -> Float32[Array, "h w 3"]:
    """The terrain as this camera sees it; what no tile covers is sky above the horizon and far ground below it.

    Tiles are drawn back to front, each in a pre-sorted order, the 3 x 3 about the eye last and sorted together.
    exact: all Gaussians are sorted together, by depth: what that order is compared with. meter: is told what it took:
    `update` (which cells, and their Gaussians placed in their orders), `sort`, `render`.
    Raises: ValueError: an orthographic camera, whose rays do not start from one eye.
    """
    if camera.orthographic:
        raise ValueError("the terrain is drawn for a pinhole camera")
    meter = meter or Meter()
    eye, here = camera.centre, replace(camera, translation=np.zeros(3))
    with meter.of("update"):
        cells = visible(terrain, camera)
        if sizes(terrain, cells).sum() > MOST:  # coarser rather than cut off; what even that has too many of goes
            terrain = coarsened(terrain, camera, MOST)
            cells = within_budget(terrain, cells)
    behind = Backdrop.of(terrain, eye, sky, ground_colour)
    far, close = [splats.NONE], [splats.NONE]
    for k in range(len(cells)):
        with meter.of("update"):
            field, slope = laid(terrain, cells[k : k + 1], eye)
        with meter.of("render"):
            part = splats.projected(behind.over(field), slope, here, terrain.near)
        (close if exact or cells.close[k] else far).append(part)
        meter.gaussians += len(field)
    with meter.of("sort"):
        ordered = splats.joined([*far, splats.sorted_by_depth(splats.joined(close))])
    with meter.of("render"):
        seen = splats.blended(ordered, here)
        return np.clip(seen.colour + (1 - seen.alpha)[..., None] * behind.seen_along(here.rays()[1]), 0, 1)
