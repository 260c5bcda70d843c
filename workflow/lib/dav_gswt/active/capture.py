"""Capture agents: each turns chosen poses into photos in a capture/ folder, with the poses asked for and those got."""

import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from dav_gswt import cameras, images
from dav_gswt.active.poses import Pose
from dav_gswt.cameras import Camera
from dav_gswt.files import write_json
from dav_gswt.logs import progress

Shot = tuple[str, Camera, float]  # the photo's file name, its camera, and how far it was taken from where it was asked


def render(take: Callable[[Camera], np.ndarray], asked: list[tuple[Pose, Camera]], folder: Path) -> list[Shot]:
    """Photos of a synthetic scene: taken exactly where they were asked for."""
    shots = []
    for pose, camera in progress(asked, "render photos"):
        images.write(folder / f"{pose.name}.png", take(camera))
        shots.append((f"{pose.name}.png", camera, 0.0))
    return shots


def replay(
    photos: Path, pool: dict[str, Camera], asked: list[tuple[Pose, Camera]], folder: Path, unit: float
) -> list[Shot]:
    """Photos of a set: for each pose the nearest unseen frame of the pool.

    Nearness: distance in units of `unit` (the flying height) plus the angle between the viewing directions in radians.
    """
    left, shots = dict(pool), []
    for _, camera in asked:
        if not left:
            break
        apart = {name: _apart(camera, other, unit) for name, other in left.items()}
        name = min(apart, key=lambda n: (apart[n], n))
        shutil.copyfile(photos / "images" / name, folder / name)
        shots.append((name, left.pop(name), float(apart[name])))
    return shots


def _apart(a: Camera, b: Camera, unit: float) -> float:
    angle = np.arccos(np.clip(a.forward @ b.forward, -1, 1))
    return float(np.linalg.norm(a.centre - b.centre) / unit + angle)


def write(folder: Path, agent: str, asked: list[tuple[Pose, Camera]], shots: list[Shot]) -> None:
    """The record of a capture: who took what, asked and got."""
    rows = [
        {
            "name": name,
            "asked": asdict(pose) | {"camera": cameras.to_json(camera)},
            "got": cameras.to_json(got),
            "asked_to_got": apart,
        }
        for (pose, camera), (name, got, apart) in zip(asked, shots, strict=False)
    ]
    write_json(folder / "capture.json", {"agent": agent, "shots": rows})
