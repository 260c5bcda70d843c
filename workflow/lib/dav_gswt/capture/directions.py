"""Directions to a pose in words, for people with a map and no instruments."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SceneFrame

COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
ON_MAP = ("top", "upper right", "right", "lower right", "bottom", "lower left", "left", "upper left")
HERE = 0.05  # flying heights: shorter walks are not mentioned
STEEP = 80.0  # degrees below the horizon from which a camera counts as looking straight down
FACING = 15.0  # degrees: largest angle past the middle that still counts as facing it


@dataclass(frozen=True)
class Ruler:
    """Formats lengths and directions of a scene. unit: the flying height in world units. metres: per world unit."""

    unit: float
    metres: float | None
    place: Georeference | None

    def format_length(self, length: float) -> str:
        """A length in world units as metres, or as flying heights if metres are not known."""
        if self.metres is None:
            count = f"{length / self.unit:.1f}"
            return f"{count} flying height{'' if count == '1.0' else 's'}"
        metres = length * self.metres
        return f"{metres:.0f} m" if metres >= 20 else f"{metres:.1f} m"

    def format_direction(self, direction: Float[Array, "d"]) -> str:
        """A compass direction, or a direction on the map if north is not known."""
        if self.place:
            return COMPASS[round(self.place.azimuth(direction) / 45) % 8]
        return f"the {ON_MAP[round(np.degrees(np.arctan2(direction[0], direction[1])) / 45) % 8]} of the map"


def make_ruler(frame: SceneFrame) -> Ruler:
    """Build the ruler of a scene."""
    place = frame.georeference
    metres = place.metres_per_unit if place else 1.0 if frame.unit == "metre" else None
    return Ruler(frame.flying_height, metres, place)


def tilt(camera: Camera) -> float:
    """Angle of the viewing direction below the horizon, degrees."""
    return float(-np.degrees(np.arcsin(np.clip(camera.forward[2], -1, 1))))


def describe_tilt(camera: Camera) -> str:
    """Say how far down or up a camera looks."""
    down = round(tilt(camera))
    if down >= STEEP:
        return "straight down" if down >= 89 else f"down {down} degrees, nearly straight down"
    return "level" if down == 0 else f"{'down' if down > 0 else 'up'} {abs(down)} degrees"


def describe_facing(camera: Camera, frame: SceneFrame, by: Ruler) -> str:
    """Say which way to face, or where the picture's top is if the camera looks down."""
    if abs(tilt(camera)) >= STEEP:
        return f"turn the top of the picture to {by.format_direction(-camera.rotation[1][:2])}"
    ahead, inwards = camera.forward[:2], (frame.exemplar.centre - camera.centre)[:2]
    towards = by.format_direction(ahead)
    across = ahead[0] * inwards[1] - ahead[1] * inwards[0]
    off = np.degrees(np.arctan2(abs(across), ahead @ inwards))
    if off > FACING or np.linalg.norm(inwards) < HERE * by.unit:
        return f"face {towards}"
    return f"face the middle, which is to {'the ' if by.place else ''}{towards}"


def describe_pose(camera: Camera, frame: SceneFrame, by: Ruler) -> str:
    """Say where to stand, how high to hold the camera, and where it looks."""
    out = (camera.centre - frame.exemplar.centre)[:2]
    away, direction = float(np.linalg.norm(out)), by.format_direction(out)
    if away < HERE * by.unit:
        position = "Stand in the middle"
    elif by.place:
        position = f"Stand {by.format_length(away)} {direction} of the middle"
    else:
        position = f"Stand {by.format_length(away)} from the middle, towards {direction}"
    up = f"camera {by.format_length(float(camera.centre[2]))} above the ground"
    return f"{position}, {up}; {describe_facing(camera, frame, by)}; look {describe_tilt(camera)}."


def describe_walk(a: Camera, b: Camera, by: Ruler) -> str:
    """Say how to walk from one pose to the next."""
    way = (b.centre - a.centre)[:2]
    far = float(np.linalg.norm(way))
    if far < HERE * by.unit:
        return "stay where you are"
    return f"go {by.format_length(far)} towards {by.format_direction(way)}"
