"""The agent `serial`: a motorised camera rig drives to each pose and releases the camera.

All poses and moves are checked before the first move. A fault stops the rig and ends the run; photos taken until then
are in the store, and the next run takes only the others. A tethered camera's software saves the photos into a folder,
the inbox.
"""

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.capture import rig_limits, serial_protocol
from dav_gswt.capture.capturing import RequestedPose, Site
from dav_gswt.capture.rig_limits import Axes, AxisLimits, Mount, build_mount
from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.lenses import undistort_scene_photo

_log = logging.getLogger(__name__)

POLL = 0.05  # seconds between queries of the position
BAUD, ANSWER_TIMEOUT, RETRIES = 115_200, 2.0, 3  # seconds for an answer; how often a question is repeated
MOVE_TIMEOUT, PHOTO_TIMEOUT = 120.0, 30.0  # seconds for a move or homing, and for a photo to be complete in the inbox
SETTLE = 1.0  # seconds of rest before a photo
PHOTO_POLL = 0.25  # seconds between looks at the inbox; a photo that did not change in between may be complete

Rig = Mapping[str, Any]  # a scene's `rig`; docs/reference/config.md describes its keys
Listing = dict[str, tuple[int, int]]


def take_photos(site: Site, requested: list[RequestedPose]) -> None:
    """Take the photos that the store lacks.

    Raises: InputError: a pose is out of reach (all such are named, nothing moves), a fault of the rig, its line or its
    camera, or a dry run.
    """
    rig: Rig = site.scene["rig"]
    list_photos(Path(rig["inbox"]))  # raises if the folder does not exist
    mount = build_mount(rig, site.frame)
    with serial_protocol.open_line(rig["port"], BAUD, ANSWER_TIMEOUT, RETRIES) as line:
        reported, home = line.hello()
        limits = rig_limits.combine_limits(rig["limits"], reported)
        stops = _plan_stops(limits, home, mount, requested)
        if rig["dry_run"]:
            for name, place in stops:
                _log.info("%s: %s", name, describe_axes(place))
        else:
            _photograph_poses(site, SerialRig(rig, line, limits, home), mount, requested)
    if rig["dry_run"]:
        raise InputError(
            f"a dry run: the rig can reach all {len(stops)} poses, nothing was moved and no photo was taken; with "
            f"scenes.{site.name}.rig.dry_run: false it takes them"
        )


def filter_reachable(scene: dict, frame: SceneFrame, candidates: list[RequestedPose]) -> list[RequestedPose]:
    """Keep the poses within the limits of the config. The rig's own limits are checked by `take_photos`.

    Raises: InputError: no pose is left.
    """
    rig: Rig = scene["rig"]
    mount = build_mount(rig, frame)
    limits = rig_limits.combine_limits(rig["limits"], np.array([[-np.inf, np.inf]] * 3))

    def is_allowed(camera: Camera) -> bool:
        return not isinstance(rig_limits.choose_turn(limits, mount.axes_of(camera), 0.0), str)

    found = [(pose, camera) for pose, camera in candidates if not mount.find_violation(camera) and is_allowed(camera)]
    _log.info("the rig can stand at %d of %d candidate poses", len(found), len(candidates))
    if candidates and not found:
        raise InputError(
            "the rig can stand at none of the candidate poses: their radius is the flying height, "
            f"{frame.flying_height * rig['millimetres']:.0f} mm; check rig.limits and rig.millimetres"
        )
    return found


def _plan_stops(limits: AxisLimits, home: Axes, mount: Mount, requested: list[RequestedPose]) -> list[tuple[str, Axes]]:
    """Plan the position of each pose, from home through all poses in order.

    Raises: InputError: names every pose that cannot be reached, and why.
    """
    if why := rig_limits.find_violation(limits, home):
        raise InputError(
            f"config: rig: the rig's home ({describe_axes(home)}) cannot be used: {why}; nothing was moved"
        )
    at, found, barred = home, [], []
    for pose, camera in requested:
        place = mount.find_violation(camera) or rig_limits.choose_turn(limits, mount.axes_of(camera), at[0])
        if isinstance(place, str):
            barred.append(f"{pose.name} ({describe_axes(mount.axes_of(camera))}): {place}")
            continue
        found.append((pose.name, place))
        at = place
    if barred:
        raise InputError(
            f"the rig cannot reach {len(barred)} of {len(requested)} poses, so nothing was moved; change rig.limits if "
            "it may go there, or ask for other poses (the scene's poses, k):\n  " + "\n  ".join(barred)
        )
    return found


def describe_axes(axes: Axes) -> str:
    """Format a position of the axes."""
    return f"pan {axes[0]:.1f}, tilt {axes[1]:.1f} degrees, radius {axes[2]:.0f} mm"


@dataclass
class SerialRig:
    """Drives a rig. at: its last commanded position; None until it is homed."""

    rig: Rig
    line: serial_protocol.SerialLine
    limits: AxisLimits
    home: Axes
    at: Axes | None = None

    def move_to(self, name: str, target: Axes) -> Axes:
        """Move to a pose, the first time from home. Returns the reported position.

        Raises: InputError: the pose is outside of the limits, or the rig ends elsewhere.
        """
        if self.at is None:
            self.line.home()
            self._wait_until_still(self.home)
        start = self.home if self.at is None else self.at
        place = rig_limits.choose_turn(self.limits, target, start[0])
        if isinstance(place, str):
            raise InputError(f"the rig cannot go on to {name} ({describe_axes(target)}): {place}")
        if not np.array_equal(place, start):
            self.line.move(place)
            self._wait_until_still(place)
        time.sleep(SETTLE)
        return self._wait_until_still(place)

    def take_photo(self, name: str, target: Axes) -> tuple[Path, Axes, str]:
        """Take one photo of a pose. Returns its file, the position of the axes, and the time."""
        folder = Path(self.rig["inbox"])
        position = self.move_to(name, target)
        before, taken = list_photos(folder), datetime.now(UTC).isoformat(timespec="seconds")
        self.line.shoot()
        if photo := wait_for_photo(folder, before, PHOTO_TIMEOUT):
            return photo, position, taken
        raise InputError(
            f"{name}: the camera was released, but no photo came into {folder} within {PHOTO_TIMEOUT:g} s; check "
            "the camera and the software that saves its photos there"
        )

    def _wait_until_still(self, goal: Axes) -> Axes:
        """Wait until the rig stands still at the goal. Returns the reported position."""
        until = time.monotonic() + MOVE_TIMEOUT
        while (reported := self.line.where())[0]:
            if time.monotonic() > until:
                raise InputError(f"the rig still moves after {MOVE_TIMEOUT:g} s, to {describe_axes(goal)}; check it")
            time.sleep(POLL)
        if (np.abs(reported[1] - goal) > rig_limits.SLACK).any():
            raise InputError(
                f"the rig stands at {describe_axes(reported[1])}, but was sent to {describe_axes(goal)}; is it blocked?"
            )
        self.at = goal
        return reported[1]


def _photograph_poses(site: Site, rig: SerialRig, mount: Mount, requested: list[RequestedPose]) -> None:
    """Take the missing photos pose by pose; each photo is checked and stored before the rig moves on."""
    for pose, camera in progress(requested, "photos by the rig"):
        photo, axes, taken = rig.take_photo(pose.name, mount.axes_of(camera))
        actual = mount.camera_at(axes, camera)
        try:  # now rather than after all other photos
            undistort_scene_photo(image_files.read_photo(photo), site.photos, actual)
        except (InputError, ValueError) as error:
            raise InputError(f"{photo}: {error}") from error
        site.store.add(photo, "serial", (pose, camera), actual, taken)


def list_photos(folder: Path) -> Listing:
    """List the photos of the inbox: size and modification time by name, so that an overwritten one counts as new.

    Raises: InputError: no such folder.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; rig.inbox is where the camera's software saves photos")
    found = {}
    for path in folder.iterdir():
        if path.suffix.lower() in image_files.SUFFIXES and not path.name.startswith("."):
            try:
                stat = path.stat()
            except FileNotFoundError:  # renamed meanwhile
                continue
            found[path.name] = (stat.st_size, stat.st_mtime_ns)
    return found


def wait_for_photo(folder: Path, before: Listing, patience: float) -> Path | None:
    """Wait for the one photo that is new since `before`, until it is complete.

    Returns: None if no photo came within `patience` seconds.

    Raises: InputError: more than one came, or one that is incomplete when the time is up.
    """
    until = time.monotonic() + patience
    last: Listing = {}
    checked: Listing = {}
    error = ""
    while True:
        now = {name: stat for name, stat in list_photos(folder).items() if before.get(name) != stat}
        if now == last and len(now) > 1:
            raise InputError(
                f"{folder}: {len(now)} photos came for one exposure ({', '.join(sorted(now)[:5])}); set the camera to "
                "single photos of one format, remove them, and run the same again"
            )
        if now and now == last and now != checked:
            path, checked = folder / next(iter(now)), now
            try:
                image_files.read_photo(path)
                return path
            except InputError as unreadable:
                error = str(unreadable)
        if time.monotonic() > until:
            break
        last = now
        time.sleep(PHOTO_POLL)
    if now:
        name = next(iter(now))
        raise InputError(f"{error or folder / name} (waited {patience:g} s for it)")
    return None
