"""A flight plan for a multicopter with a gimbal, as QGroundControl opens it (file type "Plan", version 1).

At each view the vehicle stops with its nose to where the camera looks, tilts the gimbal, waits until it is still, and
takes its photos. Altitudes are relative to where it took off, which must be on the ground of the scene: z = 0.
Sources: docs.qgroundcontrol.com, "Plan File Format"; mavlink.io, MAV_CMD.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.capture import route
from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference

View = tuple[str, Camera]

WAYPOINT, RETURN, TAKEOFF, DELAY, SPEED, GIMBAL, SHUTTER = 16, 20, 22, 93, 178, 205, 2000  # MAV_CMD
RELATIVE, NO_PLACE = 3, 2  # MAV_FRAME: a place with its altitude above home; a command without a place
PX4, QUADROTOR = 12, 2  # MAV_AUTOPILOT, MAV_TYPE
ABOVE_HOME = 1  # QGroundControl's AltitudeMode
TARGETING = 2  # MAV_MOUNT_MODE: the gimbal takes angles
GROUND_SPEED = 1  # SPEED_TYPE
HOLD, SETTLE, WRITE = 1.0, 3.0, 1.0  # seconds: to come to rest, for the gimbal to turn, for a photo to be taken
LEVEL = 0.02  # of a viewing direction: with less of it level, the picture's top says where the nose points
SAME = 0.01  # metres: places nearer are one


@dataclass(frozen=True)
class Rules:
    """What keeps a flight safe, in metres above the plane of the ground and metres a second.

    No photo is taken below least_altitude; below clearance the vehicle only climbs and sinks.
    """

    least_altitude: float = 2.0
    clearance: float = 5.0
    speed: float = 3.0


@dataclass(frozen=True)
class Flight:
    """A plan file's content, the names of its views in the order flown, and what it takes: metres, seconds.

    highest: above the plane of the ground.
    """

    content: dict
    names: tuple[str, ...]
    length: float
    duration: float
    highest: float
    home: tuple[float, float]  # latitude, longitude

    def told(self) -> str:
        """How far it goes, how long it takes, and how high."""
        minutes = np.ceil(self.duration / 60)
        return f"{self.length:.0f} m, about {minutes:.0f} min, up to {self.highest:.0f} m above the ground"

    def start(self) -> str:
        """Where the vehicle is to take off."""
        return f"{self.home[0]:.6f}, {self.home[1]:.6f}"


def flight(views: list[View], place: Georeference, home: Float[Array, "2"], rules: Rules, burst: int = 1) -> Flight:
    """A flight from a place on the ground (`home`, in the world) past all views and back.

    Raises: InputError: views below rules.least_altitude, by name.
    """
    scale = place.metres_per_unit
    at = scale * np.array([camera.centre for _, camera in views])
    low = [name for (name, _), z in zip(views, at[:, 2], strict=True) if z < rules.least_altitude]
    if low:
        raise InputError(
            f"{', '.join(low)}: lower than {rules.least_altitude:g} m above the ground, where no photo is taken from "
            "the air (flight.least_altitude of the scene's entry); take a rig or agent: handheld for poses this low"
        )
    start = scale * np.array([*home, 0.0]) + [0.0, 0.0, rules.clearance]
    ordered = route.order(at, start, start)
    stops, path = _Items(place, scale * np.array([*home, 0.0])), [start]
    stops.place(TAKEOFF, start)
    stops.do(SPEED, GROUND_SPEED, rules.speed, -1)
    for i in ordered:
        for corner in detour(path[-1], at[i], rules.clearance):
            stops.place(WAYPOINT, corner)
            path.append(corner)
        stops.photograph(at[i], views[i][1], burst)
        path.append(at[i])
    for corner in detour(path[-1], start, rules.clearance):
        stops.place(WAYPOINT, corner)
        path.append(corner)
    stops.do(RETURN)
    length = route.length(np.array([*path, start]))
    still = len(views) * (HOLD + SETTLE + burst * WRITE)
    latitude, longitude = stops.home[:2]
    return Flight(
        _whole(stops, rules),
        tuple(views[i][0] for i in ordered),
        length,
        length / rules.speed + still,
        float(at[:, 2].max()),
        (float(latitude), float(longitude)),
    )


def detour(a: Float[Array, "3"], b: Float[Array, "3"], clearance: float) -> list[Float[Array, "3"]]:
    """Where to pass between two places so that the way leads up, across and down instead of sideways below `clearance`.

    Over level ground a straight way is lowest at an end: only ends below it ask for a corner, straight above them.
    """
    if np.linalg.norm(a[:2] - b[:2]) < SAME:
        return []
    return [np.array([*end[:2], clearance]) for end in (a, b) if end[2] < clearance]


def nose_and_tilt(camera: Camera, place: Georeference) -> tuple[float, float]:
    """The vehicle's compass heading and the gimbal's pitch (0: level, -90: straight down) that a camera asks for."""
    ahead, top = camera.forward, -camera.rotation[1]
    level = float(np.hypot(*ahead[:2]))
    heading = place.azimuth(ahead if level > LEVEL else top)
    return heading, float(np.degrees(np.arctan2(ahead[2], level)))


class _Items:
    """Mission items in the making. home: latitude, longitude and altitude of where the vehicle takes off."""

    def __init__(self, place: Georeference, home: Float[Array, "3"]):
        self.reference, self.items = place, []
        self.home = self._earth(home)

    def place(self, command: int, at: Float[Array, "3"], hold: float = 0.0, heading: float | None = None) -> None:
        latitude, longitude, altitude = self._earth(at)
        up = round(float(altitude - self.home[2]), 3)
        where = [round(float(latitude), 9), round(float(longitude), 9), up]
        heights = {"AMSLAltAboveTerrain": None, "Altitude": up, "AltitudeMode": ABOVE_HOME}
        self._add(heights, command, RELATIVE, [hold, 0, 0, heading, *where])

    def do(self, command: int, *params: float | int | None) -> None:
        self._add({}, command, NO_PLACE, [*params, 0, 0, 0, 0, 0, 0, 0][:7])

    def photograph(self, at: Float[Array, "3"], camera: Camera, burst: int) -> None:
        heading, tilt = nose_and_tilt(camera, self.reference)
        self.place(WAYPOINT, at, HOLD, round(heading, 3))
        self.do(GIMBAL, round(tilt, 3), 0, 0, 0, 0, 0, TARGETING)
        self.do(DELAY, SETTLE, -1, -1, -1)
        for _ in range(burst):
            self.do(SHUTTER, 0, 0, 1, 0, None, None, None)  # one photo, no interval
            self.do(DELAY, WRITE, -1, -1, -1)

    def _earth(self, at: Float[Array, "3"]) -> Float[Array, "3"]:
        return self.reference.to_earth(at[None] / self.reference.metres_per_unit)[0]

    def _add(self, more: dict, command: int, frame: int, params: list) -> None:
        item = more | {"autoContinue": True, "command": command, "doJumpId": len(self.items) + 1, "frame": frame}
        self.items.append(item | {"params": params, "type": "SimpleItem"})


def _whole(stops: _Items, rules: Rules) -> dict:
    latitude, longitude, altitude = (float(v) for v in stops.home)
    mission = {
        "cruiseSpeed": rules.speed,
        "firmwareType": PX4,
        "globalPlanAltitudeMode": ABOVE_HOME,
        "hoverSpeed": rules.speed,
        "items": stops.items,
        "plannedHomePosition": [round(latitude, 9), round(longitude, 9), round(altitude, 3)],
        "vehicleType": QUADROTOR,
        "version": 2,
    }
    return {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": mission,
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
