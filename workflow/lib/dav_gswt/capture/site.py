"""A scene to photograph, as agents are given it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dav_gswt.capture.store import PhotoStore
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import SceneFrame

RequestedPose = tuple[Pose, Camera]


@dataclass(frozen=True)
class Site:
    """A scene to photograph.

    name, scene: its name and entry in the config. photos: its photos/ folder. store: photos taken by devices and
    people. field: the reconstruction so far, a .ply. shot_list_template: of the page that `handheld` writes.
    requested: the cameras that this round and the earlier ones request; a dropped photo stored for one is in use.
    """

    name: str
    scene: dict
    frame: SceneFrame
    photos: Path
    store: PhotoStore
    field: Path | str | None = None
    shot_list_template: Path | str = ""
    requested: tuple[Camera, ...] = ()


def view_distance(a: Camera, b: Camera, frame: SceneFrame) -> float:
    """Distance of two views: between the centres in flying heights, plus the angle between the viewing directions in
    radians."""
    angle = np.arccos(np.clip(a.forward @ b.forward, -1, 1))
    return float(np.linalg.norm(a.centre - b.centre) / frame.flying_height + angle)
