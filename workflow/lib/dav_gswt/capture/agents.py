"""The capture agents. To add one, write a function here with the decorator `agent`.

The config and the rules take the names from this registry. Every job of a run reads it, so the functions import what
they need when they are called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Agent:
    """Who takes the photos of a scene.

    Attributes:
        take: takes photos. Without `device` it is called with a `Site`, the poses, all candidates that are not used yet
            and a folder, writes photos into the folder and returns one record for each. With `device` it is called with
            a `Site` and the poses that lack photos, fills the photo store, and raises InputError as long as photos are
            missing.
        kinds: of the scenes that the agent serves.
        device: whether a device or a person takes the photos: on this machine, and never twice.
        pool: whether the candidates are photos that exist, all of which can be taken.
    """

    take: Callable[..., Any]
    kinds: tuple[str, ...]
    device: bool
    pool: bool


AGENTS: dict[str, Agent] = {}


def agent(name: str, *kinds: str, device: bool = True, pool: bool = False):
    """Register the decorated function as the one that takes an agent's photos; see `Agent`."""

    def register(take: Callable[..., Any]):
        AGENTS[name] = Agent(take, kinds, device, pool)
        return take

    return register


def list_agents(kind: str) -> tuple[str, ...]:
    """The names of the agents that serve a kind of scene."""
    return tuple(name for name, each in AGENTS.items() if kind in each.kinds)


@agent("render", "synthetic", device=False)
def render(site: Any, poses: list[Any], remaining: list[Any], folder: Path) -> list[Any]:
    """Photos of a synthetic scene are rendered exactly at their poses."""
    from dav_gswt.images.image_files import write_png
    from dav_gswt.logs import progress
    from dav_gswt.photos.capture_record import CapturedPhoto
    from dav_gswt.photos.synthetic import scene as synthetic

    world, photos = synthetic.scene_from_config(site.scene), []
    for pose, camera in progress(poses, "render photos"):
        photos.append(CapturedPhoto(f"{pose.name}.png", pose, camera, camera, 0.0))
        write_png(folder / photos[-1].name, synthetic.render(world, camera))
    return photos


@agent("replay", "synthetic", "photos", device=False, pool=True)
def replay(site: Any, poses: list[Any], remaining: list[Any], folder: Path) -> list[Any]:
    """The photo of the pool that is nearest to each pose is taken, ties by name; fewer if the pool ends."""
    import shutil

    from dav_gswt.capture.store import view_distance
    from dav_gswt.photos.capture_record import CapturedPhoto

    pool, photos = {pose.name: camera for pose, camera in remaining}, []
    for pose, camera in poses[: len(pool)]:
        distance = {name: view_distance(camera, other, site.frame) for name, other in pool.items()}
        name = min(distance, key=lambda n: (distance[n], n))
        shutil.copyfile(site.photos / "images" / name, folder / name)
        photos.append(CapturedPhoto(name, pose, camera, pool.pop(name), distance[name]))
    return photos


@agent("serial", "photos")
def serial(site: Any, missing: list[Any]) -> None:
    """A motorised camera rig on a serial port."""
    from dav_gswt.capture.serial_rig import take_photos

    take_photos(site, missing)


@agent("plan", "photos")
def plan(site: Any, missing: list[Any]) -> None:
    """A drone: its mission is written, its photos come through the drop folder."""
    from dav_gswt.capture.drone import take_photos

    take_photos(site, missing)


@agent("handheld", "photos")
def handheld(site: Any, missing: list[Any]) -> None:
    """A person: a shot list is written, the photos come through the drop folder."""
    from dav_gswt.capture.handheld import take_photos

    take_photos(site, missing)
