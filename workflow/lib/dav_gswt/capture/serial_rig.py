"""The agent `serial`: a motorised camera rig drives to each pose and releases the camera.

All poses and moves are checked before the first move. A fault stops the rig and ends the run; photos taken until then
are in the store, and the next run takes only the others. A tethered camera's software saves the photos into a folder,
the inbox.
"""

import logging
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from dav_gswt.capture import rig_limits, serial_protocol
from dav_gswt.capture.capturing import RequestedPose, Site
from dav_gswt.capture.rig_limits import Axes, AxisLimits, Mount
from dav_gswt.capture.serial_protocol import SerialLine
from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.lenses import undistort_scene_photo

_log = logging.getLogger(__name__)

POLL = 0.05  # seconds between queries of the position
MOVE_TIMEOUT, PHOTO_TIMEOUT = 120.0, 30.0  # seconds for a move or homing, and for a photo to be complete in the inbox
SETTLE = 1.0  # seconds of rest before a photo
PHOTO_POLL = 0.25  # seconds between looks at the inbox; a photo that did not change in between may be complete

Listing = dict[str, tuple[int, int]]


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
        limits = rig_limits.combine_limits(rig["limits"], reported)
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
    limits = rig_limits.combine_limits(rig["limits"], rig_limits.UNLIMITED)
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
    if why := rig_limits.find_violation(limits, home):
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
    if (np.abs(reported[1] - goal) > rig_limits.SLACK).any():
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
        if path.suffix.lower() in image_files.SUFFIXES and not path.name.startswith("."):
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
