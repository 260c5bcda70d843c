"""The agent `serial`: a motorised camera rig drives to each pose and releases the camera.

All poses and moves are checked before the first move. A fault stops the rig and ends the run; photos taken until then
are in the store, and the next run takes only the others.
"""

import logging
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from dav_gswt.capture import inbox, rig_limits, serial_protocol
from dav_gswt.capture.interface import RequestedPose
from dav_gswt.capture.rig_geometry import Mount
from dav_gswt.capture.rig_limits import Axes, AxisRanges, RigLimits
from dav_gswt.capture.site import Site
from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.lenses import undistort_scene_photo

_log = logging.getLogger(__name__)

RESTARTS = 3  # restarts of the rig that one run tolerates
POLL = 0.05  # seconds between queries of the position


@dataclass(frozen=True, kw_only=True)
class RigReach:
    """The keys of a scene's `rig` that say where it can stand; docs/reference/config.md describes them."""

    millimetres: float
    limits: AxisRanges
    pan_zero: float = 0.0
    tilt_zero: float = 0.0
    no_go: tuple[AxisRanges, ...] = ()

    def build_mount(self, frame: SceneFrame) -> Mount:
        return Mount(frame.exemplar.centre, self.millimetres, self.pan_zero, self.tilt_zero)


@dataclass(frozen=True, kw_only=True)
class RigSettings(RigReach):
    """All of a scene's `rig`."""

    port: str
    inbox: Path
    baud: int = 115200
    settle: float = 1.0
    timeout: float = 2.0
    retries: int = 3
    move_timeout: float = 120.0
    photo_timeout: float = 30.0
    dry_run: bool = True


def take_photos(site: Site, requested: list[RequestedPose]) -> None:
    """Take the photos that the store lacks.

    Raises: InputError: a pose is out of reach (all such are named, nothing moves), a fault of the rig, its line or its
    camera, or a dry run.
    """
    if "rig" not in site.scene:
        raise InputError(f"config: scenes.{site.name}.rig: the agent serial needs it (see docs/reference/config.md)")
    settings = TypeAdapter(RigSettings).validate_python(site.scene["rig"])
    inbox.list_photos(settings.inbox)  # raises if the folder does not exist
    mount = settings.build_mount(site.frame)
    with serial_protocol.open_line(settings.port, settings.baud, settings.timeout, settings.retries) as line:
        device = line.hello()
        limits = rig_limits.combine_limits(settings.limits, settings.no_go, device.limits)
        stops = _plan_stops(limits, device.home, mount, requested)
        if not settings.dry_run:
            _photograph_poses(site, SerialRig(settings, line, limits, device.home), mount, requested)
    if settings.dry_run:
        raise InputError(_describe_dry_run(site, stops))


def filter_reachable(scene: dict, frame: SceneFrame, candidates: list[RequestedPose]) -> list[RequestedPose]:
    """Keep the poses within the limits of the config. The rig's own limits are checked by `take_photos`.

    Raises: InputError: no pose is left.
    """
    if "limits" not in scene.get("rig", {}):
        return candidates
    settings = TypeAdapter(RigReach).validate_python(scene["rig"])
    mount = settings.build_mount(frame)
    limits = rig_limits.combine_limits(settings.limits, settings.no_go, np.array([[-np.inf, np.inf]] * 3))

    def is_allowed(camera: Camera) -> bool:
        places = rig_limits.list_turns(limits, mount.axes_of(camera), 0.0)
        return any(rig_limits.find_violation(limits, place) is None for place in places)

    found = [(pose, camera) for pose, camera in candidates if not mount.find_violation(camera) and is_allowed(camera)]
    _log.info("the rig can stand at %d of %d candidate poses", len(found), len(candidates))
    if candidates and not found:
        raise InputError(
            "the rig can stand at none of the candidate poses: their radius is the flying height, "
            f"{frame.flying_height * settings.millimetres:.0f} mm; check rig.limits and rig.millimetres"
        )
    return found


def _plan_stops(
    limits: RigLimits, home: Axes, mount: Mount, requested: list[RequestedPose]
) -> list[tuple[str, list[Axes]]]:
    """Plan the stops on the way to each pose, from home through all poses in order.

    Raises: InputError: names every pose that cannot be reached, and why.
    """
    if why := rig_limits.find_violation(limits, home):
        raise InputError(
            f"config: rig: the rig's home ({describe_axes(home)}) cannot be used: {why}; nothing was moved"
        )
    at, found, barred = home, [], []
    for pose, camera in requested:
        stops = mount.find_violation(camera) or rig_limits.plan_route(limits, at, mount.axes_of(camera))
        if isinstance(stops, str):
            barred.append(f"{pose.name} ({describe_axes(mount.axes_of(camera))}): {stops}")
            continue
        found.append((pose.name, stops))
        at = stops[-1] if stops else at
    if barred:
        raise InputError(
            f"the rig cannot reach {len(barred)} of {len(requested)} poses, so nothing was moved; change rig.limits or "
            "rig.no_go if it may go there, or ask for other poses (the scene's min_elevation, k):\n  "
            + "\n  ".join(barred)
        )
    return found


def _describe_dry_run(site: Site, stops: list[tuple[str, list[Axes]]]) -> str:
    """Log each move. Returns the message that ends a dry run."""
    for name, path in stops:
        _log.info("%s: %s", name, "; then ".join(describe_axes(place) for place in path) or "no move")
    return (
        f"a dry run: the rig can reach all {len(stops)} poses, nothing was moved and no photo was taken; "
        f"with scenes.{site.name}.rig.dry_run: false it takes them"
    )


def describe_axes(axes: Axes) -> str:
    """Format a position of the axes."""
    return f"pan {axes[0]:.1f}, tilt {axes[1]:.1f} degrees, radius {axes[2]:.0f} mm"


@dataclass
class SerialRig:
    """Drives a rig. at: its last commanded position; None until it is homed."""

    settings: RigSettings
    line: serial_protocol.SerialLine
    limits: RigLimits
    home: Axes
    at: Axes | None = None
    restarts: int = 0

    def move_to(self, name: str, target: Axes) -> Axes:
        """Move to a pose along its stops, from home if the position was lost. Returns the reported position.

        Raises: RigRestarted: on the way; call `recover`, then move again. InputError: no free path, or the rig ends
        elsewhere.
        """
        if self.at is None:
            self.line.home()
            self._wait_until_still(self.home)
        start = self.home if self.at is None else self.at
        stops = rig_limits.plan_route(self.limits, start, target)
        if isinstance(stops, str):
            raise InputError(f"the rig cannot go on to {name} ({describe_axes(target)}): {stops}")
        for stop in stops:
            self.line.move(stop)
            self._wait_until_still(stop)
        time.sleep(self.settings.settle)
        return self._wait_until_still(stops[-1] if stops else start)

    def recover(self) -> None:
        """Stop after a restart; the next move begins with homing. Raises: InputError: too many restarts."""
        self.at = None
        self.restarts += 1
        if self.restarts > RESTARTS:
            raise InputError(
                f"{self.settings.port}: the rig restarted {self.restarts} times; check its power and cables"
            )
        _log.warning("the rig restarted and lost its position: homing it again")
        self.line.stop()

    def _wait_until_still(self, goal: Axes) -> Axes:
        """Wait until the rig stands still at the goal. Returns the reported position."""
        until = time.monotonic() + self.settings.move_timeout
        while (reported := self.line.where())[0]:
            if time.monotonic() > until:
                raise InputError(
                    f"the rig still moves after {self.settings.move_timeout:g} s, to {describe_axes(goal)}; "
                    "if it is that slow, raise rig.move_timeout"
                )
            time.sleep(POLL)
        if (np.abs(reported[1] - goal) > rig_limits.SLACK).any():
            raise InputError(
                f"the rig stands at {describe_axes(reported[1])}, but was sent to {describe_axes(goal)}; is it blocked?"
            )
        self.at = goal
        return reported[1]


def _photograph_poses(site: Site, rig: SerialRig, mount: Mount, requested: list[RequestedPose]) -> None:
    """Take the missing photos pose by pose; each photo is stored before the rig moves on."""
    for pose, camera in progress(requested, "photos by the rig"):
        while site.missing_photos(camera) > 0:
            photo, axes, taken = _take_photo(rig, pose.name, mount.axes_of(camera))
            actual = mount.camera_at(axes, camera)
            _check_photo(photo, site, actual)
            site.store.add(photo, "serial", (pose, camera), actual, taken)


def _take_photo(rig: SerialRig, name: str, target: Axes) -> tuple[Path, Axes, str]:
    """Take one photo of a pose. Returns its file, the position of the axes, and the time.

    After a restart the pose is begun again; the camera is not released again if the photo came meanwhile.
    """
    folder, patience = rig.settings.inbox, rig.settings.photo_timeout
    before, axes, taken = None, target, ""
    while True:
        try:
            position = rig.move_to(name, target)
            if before is None or not inbox.list_new_photos(folder, before):
                before = inbox.list_photos(folder) if before is None else before
                axes, taken = position, datetime.now(UTC).isoformat(timespec="seconds")
                rig.line.shoot()
            if photo := inbox.wait_for_photo(folder, before, patience):
                return photo, axes, taken
            raise InputError(
                f"{name}: the camera was released, but no photo came into {folder} within {patience:g} s; check the "
                "camera and the software that saves its photos there, and rig.photo_timeout"
            )
        except serial_protocol.RigRestarted:
            rig.recover()
            if before is not None and (photo := inbox.wait_for_photo(folder, before, patience)):
                return photo, axes, taken


def _check_photo(photo: Path, site: Site, camera: Camera) -> None:
    """Raises: InputError: the photo is not of the scene's lens. Checked now rather than after all other photos."""
    try:
        undistort_scene_photo(image_files.read_photo(photo), site.photos, camera)
    except (InputError, ValueError) as error:
        raise InputError(f"{photo}: {error}") from error
