"""The capture agents. To add one, write a function here with the decorator `agent`.

The config, the rules and the keys that each rule reads (`config.rule_keys`) follow from this registry. Every job of a
run reads it, so the functions import what they need when they are called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import dav_gswt.capture.capturing
    import dav_gswt.geometry.scene_frame
    import dav_gswt.photos.capture_record
    import dav_gswt.views.candidates


@dataclass(frozen=True)
class Agent:
    """Who takes the photos of a scene. Keys are those of a scene's entry in the config.

    Attributes:
        take: takes photos. Without `device` it is called with a `CaptureRequest`, writes photos into its folder and
            returns one record for each. With `device` it is called with a `Site` and the poses that lack photos, fills
            the photo store, and raises InputError as long as photos are missing.
        kinds: of the scenes that the agent serves.
        poses: keys that define the candidate poses; none if the candidates are photos that exist.
        reads: further keys that taking photos reads.
        reach: keys that `keep_reachable` reads.
        keep_reachable: called with the entry, the scene frame and candidates; returns those that the agent can reach.
        device: whether a device or a person takes the photos: on this machine, and never twice.
    """

    take: Callable[..., Any]
    kinds: tuple[str, ...]
    poses: tuple[str, ...]
    reads: tuple[str, ...]
    reach: tuple[str, ...]
    keep_reachable: Callable[..., Any] | None
    device: bool


AGENTS: dict[str, Agent] = {}
POSES = ("candidates", "min_elevation", "poses")


def agent(
    name: str,
    *,
    kinds: tuple[str, ...] = ("photos",),
    poses: tuple[str, ...] = POSES,
    reads: tuple[str, ...] = (),
    reach: tuple[str, ...] = (),
    keep_reachable: Callable[..., Any] | None = None,
    device: bool = True,
):
    """Register the decorated function as the one that takes an agent's photos; see `Agent`."""

    def register(take: Callable[..., Any]):
        AGENTS[name] = Agent(take, kinds, poses, reads, reach, keep_reachable, device)
        return take

    return register


def list_agents(kind: str) -> tuple[str, ...]:
    """The names of the agents that serve a kind of scene."""
    return tuple(name for name, each in AGENTS.items() if kind in each.kinds)


@agent("render", kinds=("synthetic",), poses=(*POSES, "size"), reads=("family", "seed"), device=False)
def render(
    request: "dav_gswt.capture.capturing.CaptureRequest",
) -> list["dav_gswt.photos.capture_record.CapturedPhoto"]:
    """Photos of a synthetic scene are rendered exactly at their poses."""
    from dav_gswt.capture.simulated import capture_rendered

    return capture_rendered(request)


@agent("replay", kinds=("synthetic", "photos"), poses=(), device=False)
def replay(
    request: "dav_gswt.capture.capturing.CaptureRequest",
) -> list["dav_gswt.photos.capture_record.CapturedPhoto"]:
    """Photos that exist are taken from the pool."""
    from dav_gswt.capture.simulated import capture_replayed

    return capture_replayed(request)


def _within_rig(scene, frame, candidates):
    from dav_gswt.capture.serial_rig import filter_reachable

    return filter_reachable(scene, frame, candidates)


REACH_KEYS = ("millimetres", "pan_zero", "tilt_zero", "limits", "no_go")


@agent("serial", reads=("rig",), reach=tuple(f"rig.{key}" for key in REACH_KEYS), keep_reachable=_within_rig)
def serial(site: "dav_gswt.capture.capturing.Site", missing: list["dav_gswt.capture.capturing.RequestedPose"]) -> None:
    """A motorised camera rig on a serial port."""
    from dav_gswt.capture.serial_rig import take_photos

    take_photos(site, missing)


def _above_least_altitude(scene, frame, candidates):
    from dav_gswt.capture.drone import filter_reachable

    return filter_reachable(scene, frame, candidates)


@agent("plan", reads=("drone",), reach=("drone.min_altitude",), keep_reachable=_above_least_altitude)
def plan(site: "dav_gswt.capture.capturing.Site", missing: list["dav_gswt.capture.capturing.RequestedPose"]) -> None:
    """A drone: its mission is written, its photos come through the drop folder."""
    from dav_gswt.capture.drone import take_photos

    take_photos(site, missing)


@agent("handheld")
def handheld(
    site: "dav_gswt.capture.capturing.Site", missing: list["dav_gswt.capture.capturing.RequestedPose"]
) -> None:
    """A person: a shot list is written, the photos come through the drop folder."""
    from dav_gswt.capture.handheld import take_photos

    take_photos(site, missing)
