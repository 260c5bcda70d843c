"""The agent `plan`: writes a mission for a drone, whose photos come through the drop folder.

Missions are for a multicopter with a gimbal, in the format of QGroundControl (file type "Plan", version 1). At each
view the vehicle stops, yaws to the viewing direction, tilts the gimbal, waits, and takes a photo. Altitudes are
relative to the take-off point, which must be on the ground of the scene: z = 0.
Sources: docs.qgroundcontrol.com, "Plan File Format"; mavlink.io, MAV_CMD.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.capture import drop_folder, route
from dav_gswt.capture.store import RequestedPose, Site
from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.views.candidates import Candidates

WAYPOINT, RETURN, TAKEOFF, DELAY, SPEED, GIMBAL, SHUTTER = 16, 20, 22, 93, 178, 205, 2000  # MAV_CMD
RELATIVE, NO_PLACE = 3, 2  # MAV_FRAME: position with altitude above home; command without position
PX4, QUADROTOR = 12, 2  # MAV_AUTOPILOT, MAV_TYPE
ABOVE_HOME = 1  # QGroundControl's AltitudeMode
TARGETING = 2  # MAV_MOUNT_MODE: the gimbal takes angles
GROUND_SPEED = 1  # SPEED_TYPE
CRUISE = 3.0  # metres per second
HOLD, SETTLE, WRITE = 1.0, 3.0, 1.0  # seconds: to come to rest, for the gimbal to turn, for a photo to be taken
LEVEL = 0.02  # horizontal part of a viewing direction below which the picture's top gives the heading
SAME = 0.01  # metres: nearer positions count as equal


def filter_reachable(scene: dict, frame: SceneFrame, candidates: Candidates) -> Candidates:
    """Keep the poses that are not too low to fly to; all if the scene's unit in metres is not known.

    Raises: InputError: no pose is left.
    """
    if frame.georeference is None or not candidates:
        return candidates
    least, scale = scene["drone"]["min_altitude"], frame.georeference.metres_per_unit
    found = [(pose, camera) for pose, camera in candidates if scale * camera.centre[2] >= least]
    if not found:
        raise InputError(
            f"all {len(candidates)} candidate poses are lower than {least:g} m (drone.min_altitude of the scene's "
            "entry), too low for a drone; give `poses` larger radii or another height, or take agent: handheld"
        )
    return found


def take_photos(site: Site, requested: list[RequestedPose]) -> None:
    """Import dropped photos; for those still missing write a mission.

    Raises: InputError: photos are missing (the message says which, and what to fly), the scene has no georeference, or
        its ground is too steep.
    """
    missing = drop_folder.import_dropped_photos(site, requested, "plan")
    if not missing:
        return
    place = site.frame.georeference
    if place is None:
        raise InputError(
            f"scenes.{site.name}: a mission needs to know where on earth the scene lies (georeference in ground.json), "
            "which is known where the photos carry GPS positions in their EXIF; use photos that do, or agent: handheld"
        )
    exemplar = site.frame.exemplar
    home = np.array([exemplar.west + exemplar.side / 2, exemplar.south])
    clearance = float(site.scene["drone"]["clearance"])
    _check_level(site, place, missing, home, clearance)
    plan, description = plan_flight([camera for _, camera in missing], place, home, clearance)
    path = site.store.folder / "mission.plan"
    write_json(path, plan)
    raise InputError(
        f"{path}: fly this mission (QGroundControl: Plan, Open), {description}: "
        + drop_folder.describe_missing(site, missing)
    )


def _check_level(
    site: Site, place: Georeference, missing: list[RequestedPose], home: Float[Array, "2"], clearance: float
) -> None:
    """Check that the ground is level enough, as a mission assumes: an altitude is wrong by distance times slope.

    Raises: InputError: a pose is off by more than half its altitude, or by more than half the clearance.
    """
    at = place.metres_per_unit * np.stack([camera.centre for _, camera in missing])
    off = np.linalg.norm(at[:, :2] - place.metres_per_unit * home, axis=1) * np.tan(np.radians(place.slope))
    worst = float(off.max())
    if worst > clearance / 2 or (off > at[:, 2] / 2).any():
        raise InputError(
            f"scenes.{site.name}: the ground slopes by {place.slope:.1f} degrees, so that altitudes of a mission over "
            f"level ground would be wrong by up to {worst:.1f} m; set scenes.{site.name}.drone.clearance and "
            f"min_altitude to {np.ceil(2 * worst):.0f} or more if there is room to spare everywhere, or take agent: "
            "handheld"
        )


def plan_flight(
    views: list[Camera], place: Georeference, home: Float[Array, "2"], clearance: float
) -> tuple[dict, str]:
    """Plan a flight from a point on the ground (`home`, world units) past all views and back.

    clearance: metres above the plane of the ground, below which the vehicle only moves vertically.
    Returns: the content of the mission's file, and a description with length and duration.
    """
    scale = place.metres_per_unit
    at = scale * np.array([camera.centre for camera in views])
    start = scale * np.array([*home, 0.0]) + [0.0, 0.0, clearance]
    mission, path = _Mission(place, scale * np.array([*home, 0.0])), [start]
    mission.add_waypoint(TAKEOFF, start)
    mission.add_command(SPEED, GROUND_SPEED, CRUISE, -1)
    for i in [*route.order_stops(at, start, start), None]:
        stop = start if i is None else at[i]
        for corner in plan_detour(path[-1], stop, clearance):
            mission.add_waypoint(WAYPOINT, corner)
            path.append(corner)
        path.append(stop)
        if i is not None:
            mission.add_photo(stop, views[i])
    mission.add_command(RETURN)
    length = route.path_length(np.array(path))
    duration = length / CRUISE + len(views) * (HOLD + SETTLE + WRITE)
    latitude, longitude = mission.home[:2]
    description = (
        f"a flight of {length:.0f} m, about {np.ceil(duration / 60):.0f} min, up to {at[:, 2].max():.0f} m above the "
        f"ground; take off from the ground near {latitude:.6f}, {longitude:.6f}"
    )
    return mission.to_plan(), description


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


class _Mission:
    """Builder of a mission. home: latitude, longitude and altitude of the take-off point."""

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

    def add_photo(self, at: Float[Array, "3"], camera: Camera) -> None:
        heading, tilt = heading_and_pitch(camera, self.reference)
        self.add_waypoint(WAYPOINT, at, HOLD, round(heading, 3))
        self.add_command(GIMBAL, round(tilt, 3), 0, 0, 0, 0, 0, TARGETING)
        self.add_command(DELAY, SETTLE, -1, -1, -1)
        self.add_command(SHUTTER, 0, 0, 1, 0, None, None, None)  # one photo, no interval
        self.add_command(DELAY, WRITE, -1, -1, -1)

    def to_plan(self) -> dict:
        latitude, longitude, altitude = (float(v) for v in self.home)
        mission = {
            "cruiseSpeed": CRUISE,
            "firmwareType": PX4,
            "globalPlanAltitudeMode": ABOVE_HOME,
            "hoverSpeed": CRUISE,
            "items": self.items,
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

    def _to_earth(self, at: Float[Array, "3"]) -> Float[Array, "3"]:
        return self.reference.to_earth(at[None] / self.reference.metres_per_unit)[0]

    def _add_item(self, more: dict, command: int, frame: int, params: list) -> None:
        item = more | {"autoContinue": True, "command": command, "doJumpId": len(self.items) + 1, "frame": frame}
        self.items.append(item | {"params": params, "type": "SimpleItem"})
