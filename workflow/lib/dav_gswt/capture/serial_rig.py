"""The agent `serial`: a motorised camera rig drives to each pose and releases the camera.

The axes are pan (azimuth) and tilt (elevation) in degrees, and radius, the distance to the exemplar's centre in
millimetres. All axes of a move begin and end together, so a move is a straight line in their space and stays within
limits that hold at both ends. All poses and moves are checked before the first move.

A fault stops the rig and ends the run; photos taken until then are in the store, and the next run takes only the
others. A tethered camera's software saves the photos into a folder, the inbox.
"""

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.capture import serial_protocol
from dav_gswt.capture.serial_protocol import SerialLine
from dav_gswt.capture.store import RequestedPose, Site
from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.images.file_kinds import SUFFIXES
from dav_gswt.logs import progress
from dav_gswt.photos.lenses import undistort_scene_photo

_log = logging.getLogger(__name__)

POLL = 0.05  # seconds between queries of the position
MOVE_TIMEOUT, PHOTO_TIMEOUT = 120.0, 30.0  # seconds for a move or homing, and for a photo to be complete in the inbox
SETTLE = 1.0  # seconds of rest before a photo
PHOTO_POLL = 0.25  # seconds between looks at the inbox; a photo that did not change in between may be complete
AXES = ("pan", "tilt", "radius")
TURN = 360.0
TOLERANCE = 2.0  # degrees between a pose and how the rig holds its camera
SLACK = np.array([0.5, 0.5, 2.0])  # degrees, degrees, millimetres: tolerance of the reached position

Listing = dict[str, tuple[int, int]]
Axes = Float[Array, "3"]
AxisLimits = Float[Array, "3 2"]  # lowest and highest value of each axis
UNLIMITED = np.array([[-np.inf, np.inf]] * 3)


@dataclass(frozen=True)
class Mount:
    """Position of a rig in the scene. centre: what it turns about. millimetres: per world unit."""

    centre: Float[Array, "3"]
    millimetres: float

    def axes_of(self, camera: Camera) -> Axes:
        """Axes at which the rig holds this camera; pan from 0 to 360.

        The pan follows from the camera's x axis, which is defined also straight above. Rounded to 0.001, the resolution
        of the protocol.
        """
        out = camera.centre - self.centre
        radius = float(np.linalg.norm(out))
        elevation = np.degrees(np.arcsin(np.clip(out[2] / max(radius, 1e-12), -1, 1)))
        azimuth = np.degrees(np.arctan2(-camera.rotation[0, 0], camera.rotation[0, 1]))
        axes = [azimuth % TURN, elevation, self.millimetres * radius]
        return np.round(axes, 3)

    def camera_at(self, axes: Axes, like: Camera) -> Camera:
        """Camera at a position of the axes, with the lens of `like`."""
        pan, tilt, radius = axes
        elevation = np.clip(tilt, -90.0, 90.0)  # a rig straight above reports a little too much
        posed = camera_layouts.orbit(
            elevation, pan, radius / self.millimetres, self.centre, like.width, like.height, 60.0
        )
        return replace(like, rotation=posed.rotation, translation=posed.translation)

    def find_place(self, camera: Camera, limits: AxisLimits, pan: float) -> Axes | str:
        """The axes at which the rig can hold a camera, at the whole turn nearest to `pan`, or why there are none."""
        axes = self.axes_of(camera)
        held = self.camera_at(axes, camera).rotation
        angle = np.degrees(np.arccos(np.clip((np.trace(held.T @ camera.rotation) - 1) / 2, -1, 1)))
        if angle > TOLERANCE:
            return f"it is turned {angle:.1f} degrees away from how the rig looks: at the exemplar's centre, upright"
        return choose_turn(limits, axes, pan)


def combine_limits(limits: Mapping[str, Sequence[float | int]], device: AxisLimits) -> AxisLimits:
    """Intersect the limits of the config (lowest and highest by axis) and of the rig.

    Raises: InputError: a range from high to low, or limits without overlap.
    """
    requested = np.array([limits[axis] for axis in AXES], float)
    both = np.stack([np.maximum(requested[:, 0], device[:, 0]), np.minimum(requested[:, 1], device[:, 1])], 1)
    if empty := [axis for axis, (low, high) in zip(AXES, both, strict=True) if not low <= high]:
        raise InputError(
            f"config: rig: limits: {empty[0]} goes from high to low, or nothing of it is within what the rig itself "
            "allows"
        )
    return both


def find_violation(limits: AxisLimits, place: Axes) -> str | None:
    """Say why the rig cannot stand at a position; None if it can."""
    for axis, value, (low, high) in zip(AXES, place, limits, strict=True):
        if not low <= value <= high:
            return f"{axis} {value:g} is outside {low:g} to {high:g}"
    return None


def choose_turn(limits: AxisLimits, target: Axes, pan: float) -> Axes | str:
    """A position at the whole turn of its pan within the limits that is nearest to `pan`, or why there is none."""
    low, high = limits[0]
    turns = range(int(np.ceil((low - target[0]) / TURN)), int(np.floor((high - target[0]) / TURN)) + 1)
    if not turns:
        return f"pan {target[0]:g}, also a turn on, is outside {low:g} to {high:g}"
    place = min((target + [TURN * n, 0.0, 0.0] for n in turns), key=lambda each: abs(each[0] - pan))
    return find_violation(limits, place) or place


def take_photos(site: Site, requested: list[RequestedPose]) -> None:
    """Take the photos that the store lacks.

    Raises: InputError: a pose is out of reach (all such are named, nothing moves), a fault of the rig, its line or its
    camera, or a dry run.
    """
    rig = site.scene["rig"]
    list_photos(Path(rig["inbox"]))  # raises if the folder does not exist
    mount = Mount(site.frame.exemplar.centre, rig["millimetres"])
    with serial_protocol.open_line(rig["port"]) as line:
        reported, home = line.hello()
        limits = combine_limits(rig["limits"], reported)
        stops = _plan_stops(limits, home, mount, requested)
        if not rig["dry_run"]:
            line.home()
            _wait_until_still(line, home)
            for asked, place in progress(list(zip(requested, stops, strict=True)), "photos by the rig"):
                _photograph_pose(site, line, mount, asked, place)
    if rig["dry_run"]:
        for (pose, _), place in zip(requested, stops, strict=True):
            _log.info("%s: %s", pose.name, describe_axes(place))
        raise InputError(
            f"a dry run: the rig can reach all {len(stops)} poses, nothing was moved and no photo was taken; with "
            f"scenes.{site.name}.rig.dry_run: false it takes them"
        )


def filter_reachable(scene: dict, frame: SceneFrame, candidates: list[RequestedPose]) -> list[RequestedPose]:
    """Keep the poses within the limits of the config. The rig's own limits are checked by `take_photos`.

    Raises: InputError: no pose is left.
    """
    rig = scene["rig"]
    mount = Mount(frame.exemplar.centre, rig["millimetres"])
    limits = combine_limits(rig["limits"], UNLIMITED)
    found = [each for each in candidates if not isinstance(mount.find_place(each[1], limits, 0.0), str)]
    _log.info("the rig can stand at %d of %d candidate poses", len(found), len(candidates))
    if candidates and not found:
        raise InputError(
            "the rig can stand at none of the candidate poses: their radius is the flying height, "
            f"{frame.flying_height * rig['millimetres']:.0f} mm; check rig.limits and rig.millimetres"
        )
    return found


def _plan_stops(limits: AxisLimits, home: Axes, mount: Mount, requested: list[RequestedPose]) -> list[Axes]:
    """Plan the position of each pose, from home through all poses in order.

    Raises: InputError: names every pose that cannot be reached, and why.
    """
    if why := find_violation(limits, home):
        raise InputError(
            f"config: rig: the rig's home ({describe_axes(home)}) cannot be used: {why}; nothing was moved"
        )
    stops, barred = [home], []
    for pose, camera in requested:
        place = mount.find_place(camera, limits, stops[-1][0])
        if isinstance(place, str):
            barred.append(f"{pose.name} ({describe_axes(mount.axes_of(camera))}): {place}")
        else:
            stops.append(place)
    if barred:
        raise InputError(
            f"the rig cannot reach {len(barred)} of {len(requested)} poses, so nothing was moved; change rig.limits if "
            "it may go there, or ask for other poses (the scene's poses, k):\n  " + "\n  ".join(barred)
        )
    return stops[1:]


def describe_axes(axes: Axes) -> str:
    """Format a position of the axes."""
    return f"pan {axes[0]:.1f}, tilt {axes[1]:.1f} degrees, radius {axes[2]:.0f} mm"


def _wait_until_still(line: SerialLine, goal: Axes) -> Axes:
    """Wait until the rig stands still at the goal. Returns the reported position."""
    until = time.monotonic() + MOVE_TIMEOUT
    while (reported := line.where())[0]:
        if time.monotonic() > until:
            raise InputError(f"the rig still moves after {MOVE_TIMEOUT:g} s, to {describe_axes(goal)}; check it")
        time.sleep(POLL)
    if (np.abs(reported[1] - goal) > SLACK).any():
        raise InputError(
            f"the rig stands at {describe_axes(reported[1])}, but was sent to {describe_axes(goal)}; is it blocked?"
        )
    return reported[1]


def _photograph_pose(site: Site, line: SerialLine, mount: Mount, requested: RequestedPose, place: Axes) -> None:
    """Move to a pose and take its photo, which is checked and stored before the rig moves on."""
    inbox, (_, camera) = Path(site.scene["rig"]["inbox"]), requested
    line.move(place)
    _wait_until_still(line, place)
    time.sleep(SETTLE)
    actual = mount.camera_at(_wait_until_still(line, place), camera)
    before, taken = list_photos(inbox), datetime.now(UTC).isoformat(timespec="seconds")
    line.shoot()
    photo = wait_for_photo(inbox, before)
    try:  # now rather than after all other photos
        undistort_scene_photo(image_files.read_photo(photo), site.photos, actual)
    except (InputError, ValueError) as error:
        raise InputError(f"{photo}: {error}") from error
    site.store.add(photo, "serial", requested, actual, taken)


def list_photos(folder: Path) -> Listing:
    """List the photos of the inbox: size and modification time by name, so that an overwritten one counts as new.

    Raises: InputError: no such folder.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; rig.inbox is where the camera's software saves photos")
    found = {}
    for path in folder.iterdir():
        if path.suffix.lower() in SUFFIXES and not path.name.startswith("."):
            try:
                stat = path.stat()
            except FileNotFoundError:  # renamed meanwhile
                continue
            found[path.name] = (stat.st_size, stat.st_mtime_ns)
    return found


def wait_for_photo(folder: Path, before: Listing) -> Path:
    """Wait for the one photo that is new since `before`, until it is complete.

    Raises: InputError: more than one came, or within PHOTO_TIMEOUT seconds none that is complete.
    """
    until, last = time.monotonic() + PHOTO_TIMEOUT, Listing()
    problem = f"the camera was released, but no photo came into {folder}; check it, and what saves its photos there"
    while time.monotonic() < until:
        now = {name: stat for name, stat in list_photos(folder).items() if before.get(name) != stat}
        if now == last and len(now) > 1:
            raise InputError(
                f"{folder}: {len(now)} photos came for one exposure ({', '.join(sorted(now)[:5])}); set the camera to "
                "single photos of one format, remove them, and run the same again"
            )
        if now and now == last:
            path = folder / next(iter(now))
            try:
                image_files.read_photo(path)
                return path
            except InputError as unreadable:
                problem = str(unreadable)
        last = now
        time.sleep(PHOTO_POLL)
    raise InputError(f"{problem} (waited {PHOTO_TIMEOUT:g} s)")
