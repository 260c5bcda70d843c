"""How to get to a pose, in words: for people who have a map and no instruments."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.poses import middle
from dav_gswt.geometry.scene_frame import SceneFrame

COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
ON_MAP = ("top", "upper right", "right", "lower right", "bottom", "lower left", "left", "upper left")
HERE = 0.05  # flying heights: less is no way to go
STEEP = 80.0  # degrees: below the horizon, from which a camera looks straight down
FACING = 15.0  # degrees: who looks past the middle by less, faces it


@dataclass(frozen=True)
class Ruler:
    """Lengths and directions of a scene for people. unit: the flying height in world units."""

    unit: float
    metres: float | None  # in a world unit, where that is known
    place: Georeference | None

    def length(self, of: float) -> str:
        """A length of the world, in metres where these are known, else in flying heights."""
        if self.metres is None:
            return self.heights(of)
        many = of * self.metres
        return f"{many:.0f} m" if many >= 20 else f"{many:.1f} m"

    def heights(self, of: float) -> str:
        """A length of the world in flying heights."""
        many = f"{of / self.unit:.1f}"
        return f"{many} flying height{'' if many == '1.0' else 's'}"

    def towards(self, direction: Float[Array, "d"]) -> str:
        """A direction: of the compass where north is known, else on the map."""
        if self.place:
            return COMPASS[round(self.place.azimuth(direction) / 45) % 8]
        return f"the {ON_MAP[round(np.degrees(np.arctan2(direction[0], direction[1])) / 45) % 8]} of the map"


def ruler(frame: SceneFrame) -> Ruler:
    """The ruler of a scene, from its ground.json."""
    place = frame.georeference
    metres = place.metres_per_unit if place else 1.0 if frame.unit == "metre" else None
    return Ruler(frame.flying_height, metres, place)


def tilt(camera: Camera) -> float:
    """Degrees below the horizon that a camera looks."""
    return float(-np.degrees(np.arcsin(np.clip(camera.forward[2], -1, 1))))


def looking(camera: Camera) -> str:
    """How far down or up a camera looks."""
    down = round(tilt(camera))
    if down >= STEEP:
        return "straight down" if down >= 89 else f"down {down} degrees, nearly straight down"
    return "level" if down == 0 else f"{'down' if down > 0 else 'up'} {abs(down)} degrees"


def heading(camera: Camera) -> Float[Array, "3"]:
    """The level direction that whoever holds the camera faces: ahead, or the picture's top where it looks down."""
    return -camera.rotation[1] if abs(tilt(camera)) >= STEEP else camera.forward


def facing(camera: Camera, frame: SceneFrame, by: Ruler) -> str:
    """Where to turn to."""
    ahead, inwards = heading(camera)[:2], (middle(frame) - camera.centre)[:2]
    towards = by.towards(ahead)
    if abs(tilt(camera)) >= STEEP:
        return f"turn the top of the picture to {towards}"
    across = ahead[0] * inwards[1] - ahead[1] * inwards[0]
    off = np.degrees(np.arctan2(abs(across), ahead @ inwards))
    if off > FACING or np.linalg.norm(inwards) < HERE * by.unit:
        return f"face {towards}"
    return f"face the middle, which is to {'the ' if by.place else ''}{towards}"


def standing(camera: Camera, frame: SceneFrame, by: Ruler) -> str:
    """Where to stand."""
    out = (camera.centre - middle(frame))[:2]
    away = float(np.linalg.norm(out))
    if away < HERE * by.unit:
        return "Stand in the middle"
    if by.place:
        return f"Stand {by.length(away)} {by.towards(out)} of the middle"
    return f"Stand {by.length(away)} from the middle, towards {by.towards(out)}"


def told(camera: Camera, frame: SceneFrame, by: Ruler) -> str:
    """The whole of it: where to stand, how high the camera is, where it looks."""
    up = f"camera {by.length(float(camera.centre[2]))} above the ground"
    return f"{standing(camera, frame, by)}, {up}; {facing(camera, frame, by)}; look {looking(camera)}."


def walked(a: Camera, b: Camera, by: Ruler) -> str:
    """How to get from one pose to the next."""
    way = (b.centre - a.centre)[:2]
    far = float(np.linalg.norm(way))
    return "stay where you are" if far < HERE * by.unit else f"go {by.length(far)} towards {by.towards(way)}"
