"""Flight plans for a multicopter with a gimbal, in the format of QGroundControl (file type "Plan", version 1).

At each view the vehicle stops, yaws to the viewing direction, tilts the gimbal, waits, and takes its photos. Altitudes
are relative to the take-off point, which must be on the ground of the scene: z = 0.
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

NamedCamera = tuple[str, Camera]

WAYPOINT, RETURN, TAKEOFF, DELAY, SPEED, GIMBAL, SHUTTER = 16, 20, 22, 93, 178, 205, 2000  # MAV_CMD
RELATIVE, NO_PLACE = 3, 2  # MAV_FRAME: position with altitude above home; command without position
PX4, QUADROTOR = 12, 2  # MAV_AUTOPILOT, MAV_TYPE
ABOVE_HOME = 1  # QGroundControl's AltitudeMode
TARGETING = 2  # MAV_MOUNT_MODE: the gimbal takes angles
GROUND_SPEED = 1  # SPEED_TYPE
HOLD, SETTLE, WRITE = 1.0, 3.0, 1.0  # seconds: to come to rest, for the gimbal to turn, for a photo to be taken
LEVEL = 0.02  # horizontal part of a viewing direction below which the picture's top gives the heading
SAME = 0.01  # metres: nearer positions count as equal


@dataclass(frozen=True)
class FlightRules:
    """Safety limits of a flight, in metres above the plane of the ground and metres per second.

    No photo is taken below min_altitude; below clearance the vehicle only moves vertically.
    """

    min_altitude: float = 2.0
    clearance: float = 5.0
    speed: float = 3.0


@dataclass(frozen=True)
class SurveyFlight:
    """A plan: content of its file, names of its views in flight order, length in metres, duration in seconds.

    highest: metres above the plane of the ground.
    """

    content: dict
    names: tuple[str, ...]
    length: float
    duration: float
    highest: float
    home: tuple[float, float]  # latitude, longitude

    def describe(self) -> str:
        """Say length, duration and greatest height."""
        minutes = np.ceil(self.duration / 60)
        return f"{self.length:.0f} m, about {minutes:.0f} min, up to {self.highest:.0f} m above the ground"

    def describe_home(self) -> str:
        """Latitude and longitude of the take-off point."""
        return f"{self.home[0]:.6f}, {self.home[1]:.6f}"


def plan_flight(
    views: list[NamedCamera], place: Georeference, home: Float[Array, "2"], rules: FlightRules, burst: int = 1
) -> SurveyFlight:
    """Plan a flight from a point on the ground (`home`, world units) past all views and back.

    Raises: InputError: views below rules.min_altitude, by name.
    """
    scale = place.metres_per_unit
    at = scale * np.array([camera.centre for _, camera in views])
    low = [name for (name, _), z in zip(views, at[:, 2], strict=True) if z < rules.min_altitude]
    if low:
        raise InputError(
            f"{', '.join(low)}: lower than {rules.min_altitude:g} m above the ground, where no photo is taken from "
            "the air (drone.min_altitude of the scene's entry); take a rig or agent: handheld for poses this low"
        )
    start = scale * np.array([*home, 0.0]) + [0.0, 0.0, rules.clearance]
    ordered = route.order_stops(at, start, start)
    stops, path = _MissionItems(place, scale * np.array([*home, 0.0])), [start]
    stops.add_waypoint(TAKEOFF, start)
    stops.add_command(SPEED, GROUND_SPEED, rules.speed, -1)
    for i in ordered:
        for corner in plan_detour(path[-1], at[i], rules.clearance):
            stops.add_waypoint(WAYPOINT, corner)
            path.append(corner)
        stops.add_photos(at[i], views[i][1], burst)
        path.append(at[i])
    for corner in plan_detour(path[-1], start, rules.clearance):
        stops.add_waypoint(WAYPOINT, corner)
        path.append(corner)
    stops.add_command(RETURN)
    length = route.path_length(np.array([*path, start]))
    still = len(views) * (HOLD + SETTLE + burst * WRITE)
    latitude, longitude = stops.home[:2]
    return SurveyFlight(
        _plan_content(stops, rules),
        tuple(views[i][0] for i in ordered),
        length,
        length / rules.speed + still,
        float(at[:, 2].max()),
        (float(latitude), float(longitude)),
    )


def plan_detour(a: Float[Array, "3"], b: Float[Array, "3"], clearance: float) -> list[Float[Array, "3"]]:
    """Corners of a path that climbs, crosses and descends instead of moving sideways below `clearance`.

    Over level ground a straight path is lowest at an end: each end below the clearance gets a corner straight above it.
    """
    if np.linalg.norm(a[:2] - b[:2]) < SAME:
        return []
    return [np.array([*end[:2], clearance]) for end in (a, b) if end[2] < clearance]


def heading_and_pitch(camera: Camera, place: Georeference) -> tuple[float, float]:
    """Compass heading of the vehicle and pitch of the gimbal (0: level, -90: straight down) for a camera, degrees."""
    ahead, top = camera.forward, -camera.rotation[1]
    level = float(np.hypot(*ahead[:2]))
    heading = place.azimuth(ahead if level > LEVEL else top)
    return heading, float(np.degrees(np.arctan2(ahead[2], level)))


class _MissionItems:
    """Builder of mission items. home: latitude, longitude and altitude of the take-off point."""

    def __init__(self, place: Georeference, home: Float[Array, "3"]):
        self.reference = place
        self.items: list[dict] = []
        self.home = self._to_earth(home)

    def add_waypoint(
        self, command: int, at: Float[Array, "3"], hold: float = 0.0, heading: float | None = None
    ) -> None:
        latitude, longitude, altitude = self._to_earth(at)
        up = round(float(altitude - self.home[2]), 3)
        where = [round(float(latitude), 9), round(float(longitude), 9), up]
        heights = {"AMSLAltAboveTerrain": None, "Altitude": up, "AltitudeMode": ABOVE_HOME}
        self._add_item(heights, command, RELATIVE, [hold, 0, 0, heading, *where])

    def add_command(self, command: int, *params: float | int | None) -> None:
        self._add_item({}, command, NO_PLACE, [*params, 0, 0, 0, 0, 0, 0, 0][:7])

    def add_photos(self, at: Float[Array, "3"], camera: Camera, burst: int) -> None:
        heading, tilt = heading_and_pitch(camera, self.reference)
        self.add_waypoint(WAYPOINT, at, HOLD, round(heading, 3))
        self.add_command(GIMBAL, round(tilt, 3), 0, 0, 0, 0, 0, TARGETING)
        self.add_command(DELAY, SETTLE, -1, -1, -1)
        for _ in range(burst):
            self.add_command(SHUTTER, 0, 0, 1, 0, None, None, None)  # one photo, no interval
            self.add_command(DELAY, WRITE, -1, -1, -1)

    def _to_earth(self, at: Float[Array, "3"]) -> Float[Array, "3"]:
        return self.reference.to_earth(at[None] / self.reference.metres_per_unit)[0]

    def _add_item(self, more: dict, command: int, frame: int, params: list) -> None:
        item = more | {"autoContinue": True, "command": command, "doJumpId": len(self.items) + 1, "frame": frame}
        self.items.append(item | {"params": params, "type": "SimpleItem"})


def _plan_content(stops: _MissionItems, rules: FlightRules) -> dict:
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
