"""The agent of a motorised camera rig: drives to each pose, releases the camera, keeps the photo.

Every pose and every move is checked before the first one. What goes wrong stops the rig and ends the run; the photos
that were taken until then are in the store, and the next run takes only the others.
"""

import logging
import time
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from dav_gswt.capture import inbox, rig_limits, serial_protocol
from dav_gswt.capture.rig_geometry import Mount
from dav_gswt.capture.rig_limits import Axes, Reach
from dav_gswt.capture.shots import Asked
from dav_gswt.capture.site import Site
from dav_gswt.errors import InputError
from dav_gswt.geometry.poses import middle
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos import lenses

_log = logging.getLogger(__name__)

DEFAULTS = {
    "baud": 115200,
    "pan_zero": 0.0,
    "tilt_zero": 0.0,
    "no_go": [],
    "settle": 1.0,
    "timeout": 2.0,
    "retries": 3,
    "move_timeout": 120.0,
    "photo_timeout": 30.0,
    "dry_run": True,
}
RESTARTS = 3  # of the rig in one run: one that restarts more often has trouble that homing does not mend
POLL = 0.05  # seconds between questions where it is


def take(site: Site, asked: list[Asked]) -> None:
    """Put the photos that the poses still lack into the site's store.

    Raises: InputError: a pose that the rig cannot reach (all are named, nothing has moved), a fault of the rig, its
    line or its camera, or a dry run.
    """
    if "rig" not in site.scene:
        raise InputError(f"config: scenes.{site.name}.rig: the agent serial needs it (config/README.md has its keys)")
    rig = DEFAULTS | site.scene["rig"]
    inbox.listing(Path(rig["inbox"]))  # is it there?
    mount = Mount(middle(site.frame), float(rig["millimetres"]), float(rig["pan_zero"]), float(rig["tilt_zero"]))
    with serial_protocol.opened(rig["port"], rig["baud"], float(rig["timeout"]), rig["retries"]) as wire:
        device = wire.hello()
        there = rig_limits.reach(rig["limits"], rig["no_go"], device.limits)
        stops = _checked(there, device.home, mount, asked)
        if not rig["dry_run"]:
            _drive(site, Driver(rig, wire, there, device.home), mount, asked)
    if rig["dry_run"]:
        raise InputError(_rehearsed(site, stops))


def within(scene: dict, frame: SceneFrame, pool: list[Asked]) -> list[Asked]:
    """The poses where the rig may stand by the config's limits: it is asked for no others. Its own come with `take`.

    Raises: InputError: there is none.
    """
    rig = DEFAULTS | scene.get("rig", {})
    if "limits" not in rig:
        return pool
    mount = Mount(middle(frame), float(rig["millimetres"]), float(rig["pan_zero"]), float(rig["tilt_zero"]))
    there = rig_limits.reach(rig["limits"], rig["no_go"], np.array([[-np.inf, np.inf]] * 3))

    def stands(camera) -> bool:
        places = rig_limits.turns(there, mount.axes(camera), 0.0)
        return any(rig_limits.trouble(there, place) is None for place in places)

    found = [(pose, camera) for pose, camera in pool if not mount.trouble(camera) and stands(camera)]
    _log.info("the rig can stand at %d of %d candidate poses", len(found), len(pool))
    if pool and not found:
        raise InputError(
            "the rig can stand at none of the candidate poses: their radius is the flying height, "
            f"{frame.flying_height * rig['millimetres']:.0f} mm; check rig.limits and rig.millimetres"
        )
    return found


def _checked(there: Reach, home: Axes, mount: Mount, asked: list[Asked]) -> list[tuple[str, list[Axes]]]:
    """The stops on the way to each pose by name, from home through all of them in order.

    Raises: InputError: names every pose that cannot be reached, and why.
    """
    if why := rig_limits.trouble(there, home):
        raise InputError(f"config: rig: the rig's home ({told(home)}) cannot be used: {why}; nothing was moved")
    at, found, barred = home, [], []
    for pose, camera in asked:
        stops = mount.trouble(camera) or rig_limits.route(there, at, mount.axes(camera))
        if isinstance(stops, str):
            barred.append(f"{pose.name} ({told(mount.axes(camera))}): {stops}")
            continue
        found.append((pose.name, stops))
        at = stops[-1] if stops else at
    if barred:
        raise InputError(
            f"the rig cannot reach {len(barred)} of {len(asked)} poses, so nothing was moved; change rig.limits or "
            "rig.no_go if it may go there, or ask for other poses (the scene's lowest, k):\n  " + "\n  ".join(barred)
        )
    return found


def _rehearsed(site: Site, stops: list[tuple[str, list[Axes]]]) -> str:
    """Say each move; returns what to do to have them done."""
    for name, way in stops:
        _log.info("%s: %s", name, "; then ".join(told(place) for place in way) or "where it stands")
    return (
        f"a dry run: the rig can reach all {len(stops)} poses, nothing was moved and no photo was taken; "
        f"with scenes.{site.name}.rig.dry_run: false it takes them"
    )


def told(axes: Axes) -> str:
    """A place of the axes for people."""
    return f"pan {axes[0]:.1f}, tilt {axes[1]:.1f} degrees, radius {axes[2]:.0f} mm"


@dataclass
class Driver:
    """A rig on its way. at: the place where it was sent to and stands; None until it is homed."""

    rig: dict
    wire: serial_protocol.Line
    there: Reach
    home: Axes
    at: Axes | None = None
    restarts: int = field(default=0)

    def go(self, name: str, wanted: Axes) -> Axes:
        """Stand still at a pose, over its stops, from home if the place was lost; returns where the axes say it is.

        Raises: Rebooted: on the way; call `restarted`, then go again. InputError: no free way, or it gets elsewhere.
        """
        if self.at is None:
            self.wire.home()
            self._arrived(self.home)
        stops = rig_limits.route(self.there, self.at, wanted)
        if isinstance(stops, str):
            raise InputError(f"the rig cannot go on to {name} ({told(wanted)}): {stops}")
        for stop in stops:
            self.wire.move(stop)
            self._arrived(stop)
        time.sleep(float(self.rig["settle"]))
        return self._arrived(self.at)

    def restarted(self) -> None:
        """After a restart: stand still, and begin from home again. Raises: InputError: too often."""
        self.at = None
        self.restarts += 1
        if self.restarts > RESTARTS:
            raise InputError(f"{self.rig['port']}: the rig restarted {self.restarts} times; check its power and cables")
        _log.warning("the rig restarted and lost its place: homing it again")
        self.wire.stop()

    def _arrived(self, goal: Axes) -> Axes:
        """Wait until it stands still; it must be at the goal."""
        until = time.monotonic() + self.rig["move_timeout"]
        while (reported := self.wire.where())[0]:
            if time.monotonic() > until:
                raise InputError(
                    f"the rig still moves after {self.rig['move_timeout']:g} s, to {told(goal)}; if it is that slow, "
                    "raise rig.move_timeout"
                )
            time.sleep(POLL)
        if (np.abs(reported[1] - goal) > rig_limits.SLACK).any():
            raise InputError(
                f"the rig stands at {told(reported[1])}, but was sent to {told(goal)}; does something bar it?"
            )
        self.at = goal
        return reported[1]


def _drive(site: Site, driver: Driver, mount: Mount, asked: list[Asked]) -> None:
    """Take what the store lacks, pose by pose; each photo is in the store before the rig moves on."""
    for pose, camera in progress(asked, "photos by the rig"):
        while len(site.store.of(camera)) < site.burst:
            photo, axes, taken = _photo(driver, pose.name, mount.axes(camera))
            got = mount.camera(axes, camera)
            _usable(photo, site, got)
            site.store.add(photo, "serial", pose, camera, got, taken)


def _photo(driver: Driver, name: str, wanted: Axes) -> tuple[Path, Axes, str]:
    """One photo of a pose: its file, where the axes were, and when.

    Where the rig restarts, the pose is begun again, but the camera is not released again if the photo came meanwhile.
    """
    folder, patience = Path(driver.rig["inbox"]), float(driver.rig["photo_timeout"])
    before, axes, taken = None, None, ""
    while True:
        try:
            stands = driver.go(name, wanted)
            if before is None or not inbox.new(folder, before):
                before = inbox.listing(folder) if before is None else before
                axes, taken = stands, datetime.now(UTC).isoformat(timespec="seconds")
                driver.wire.shoot()
            if photo := inbox.arrived(folder, before, patience):
                return photo, axes, taken
            raise InputError(
                f"{name}: the camera was released, but no photo came into {folder} within {patience:g} s; check the "
                "camera and the software that saves its photos there, and rig.photo_timeout"
            )
        except serial_protocol.Rebooted:
            driver.restarted()
            if before is not None and (photo := inbox.arrived(folder, before, patience)):
                return photo, axes, taken


def _usable(photo: Path, site: Site, got) -> None:
    """A photo that the scene's lens did not take is better refused now than after all others."""
    try:
        lenses.developed(image_files.read_photo(photo), site.photos, got)
    except (InputError, ValueError) as error:
        raise InputError(f"{photo}: {error}") from error
