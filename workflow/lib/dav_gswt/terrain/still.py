"""Stills of the endless terrain, drawn by the same rasterizer that fitted it, over a sky and a far ground."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import cameras
from dav_gswt.cameras import Camera
from dav_gswt.field import Field, sh_of
from dav_gswt.raster import render
from dav_gswt.terrain.assemble import REACH, Terrain, laid, visible

FADE = 0.5  # share of the reach from which tiles go over into the far ground


@dataclass(frozen=True)
class Shot:
    """A still to take: where the eye is, in tiles and eye heights, and how it looks."""

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


def camera_of(shot: Shot, side: float, floor: float, width: int, height: int) -> Camera:
    """The shot's camera, 60 degrees wide."""
    eye = np.array([shot.at[0] * side, shot.at[1] * side, shot.height * floor])
    down, yaw = np.radians(min(shot.pitch, 89.99)), np.radians(shot.yaw)
    ahead = np.array([np.cos(down) * np.cos(yaw), np.cos(down) * np.sin(yaw), -np.sin(down)])
    return cameras.pinhole(eye, eye + ahead, width, height, 60.0)


def draw(terrain: Terrain, camera: Camera, sky: dict, ground_colour) -> Float32[Array, "h w 3"]:
    """The terrain as this camera sees it; what no tile covers is sky above the horizon and far ground below it."""
    about = camera.centre
    field = faded(laid(terrain, visible(terrain, camera), about * [1, 1, 0]), REACH * terrain.side, ground_colour)
    near = replace(camera, translation=-camera.rotation @ (about * [0, 0, 1]))
    seen = render(field, near)
    return np.clip(seen.colour + (1 - seen.alpha)[..., None] * backdrop(near, terrain, sky, ground_colour), 0, 1)


def faded(field: Field, reach: float, ground_colour) -> Field:
    """The far end of what is laid goes over into the mean ground colour, so that no edge shows where tiles end."""
    away = np.hypot(field.means[:, 0], field.means[:, 1]) / reach
    share = np.clip((away - FADE) / (1 - FADE), 0, 1)[:, None]
    share = share * share * (3 - 2 * share)
    sh = field.sh.copy()
    sh[:, 0] += share.astype(np.float32) * (sh_of(np.array([ground_colour]))[0] - sh[:, 0])
    return replace(field, sh=sh)


def backdrop(camera: Camera, terrain: Terrain, sky: dict, ground_colour) -> Float32[Array, "h w 3"]:
    """Sky by elevation, and ground of the mean colour that pales to the horizon beyond the last tiles."""
    _, step = camera.rays()
    rise = step[..., 2] / np.linalg.norm(step, axis=-1)
    zenith, horizon, ground = (np.asarray(c, np.float32) for c in (sky["zenith"], sky["horizon"], ground_colour))
    up = np.clip(rise, 0, 1)[..., None] ** 0.5
    above = horizon + (zenith - horizon) * up
    far = camera.centre[2] / (REACH * terrain.side)  # sine at which the last tiles end
    pale = np.exp(np.clip(rise, -1, 0) / (0.3 * far))[..., None]
    below = ground + (horizon - ground) * pale
    return np.where(rise[..., None] > 0, above, below).astype(np.float32)
