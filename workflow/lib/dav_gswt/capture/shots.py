"""What every agent hands over: photos, where each was asked for, and where it was really taken."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dav_gswt.files import write_json
from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose

Asked = tuple[Pose, Camera]


@dataclass(frozen=True)
class Shot:
    """A photo of a capture/ folder. name: its file. taken: when (ISO 8601), where a device took it."""

    name: str
    pose: Pose
    asked: Camera
    got: Camera
    apart: float
    taken: str | None = None


def apart(a: Camera, b: Camera, unit: float) -> float:
    """How far two cameras are from showing the same: their distance in units of `unit` (the flying height) plus the
    angle between their viewing directions in radians."""
    angle = np.arccos(np.clip(a.forward @ b.forward, -1, 1))
    return float(np.linalg.norm(a.centre - b.centre) / unit + angle)


def write(folder: Path, agent: str, shots: list[Shot]) -> None:
    """The record of a capture, capture.json: who took what, asked and got."""
    rows = [
        {
            "name": shot.name,
            "asked": asdict(shot.pose) | {"camera": cameras.to_json(shot.asked)},
            "got": cameras.to_json(shot.got),
            "asked_to_got": shot.apart,
            "taken": shot.taken,
        }
        for shot in shots
    ]
    write_json(folder / "capture.json", {"agent": agent, "shots": rows})
