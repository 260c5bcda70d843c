"""Candidate poses: places on a hemisphere over the exemplar, as (elevation, azimuth, radius) and a camera each."""

import csv
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.cameras import Camera
from dav_gswt.errors import InputError
from dav_gswt.files import whole


@dataclass(frozen=True)
class Pose:
    """A camera's place about the exemplar's centre: degrees, degrees, world units. name: unique in its scene."""

    name: str
    elevation: float
    azimuth: float
    radius: float


@dataclass(frozen=True)
class Scored:
    """A candidate pose and its terms of uncertainty, kept apart: they are weighed when poses are chosen."""

    pose: Pose
    opacity: float  # mean over the picture of what is not known to be opaque, 0 to 1


def middle(frame: dict) -> Float[Array, "3"]:
    """The exemplar's centre on the plane z = 0."""
    exemplar = frame["exemplar"]
    return np.array([exemplar["west"] + exemplar["side"] / 2, exemplar["south"] + exemplar["side"] / 2, 0.0])


def of_camera(name: str, camera: Camera, frame: dict) -> Pose:
    """Where a camera stands, as a pose about the exemplar's centre."""
    x, y, z = camera.centre - middle(frame)
    radius = float(np.sqrt(x * x + y * y + z * z))
    elevation = float(np.degrees(np.arcsin(np.clip(z / max(radius, 1e-12), -1, 1))))
    return Pose(name, elevation, float(np.degrees(np.arctan2(y, x)) % 360), radius)


def place(pose: Pose) -> Float[Array, "3"]:
    """The pose's position relative to the exemplar's centre."""
    e, a = np.radians(pose.elevation), np.radians(pose.azimuth)
    return pose.radius * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def write_scores(path: Path | str, scored: list[Scored]) -> None:
    """One row a candidate; numbers as they are, so that reading gives the same bits."""
    with whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["pose", "elevation", "azimuth", "radius", "opacity"])
        for s in scored:
            table.writerow(
                [s.pose.name, repr(s.pose.elevation), repr(s.pose.azimuth), repr(s.pose.radius), repr(s.opacity)]
            )


def read_scores(path: Path | str) -> list[Scored]:
    """The candidates that `write_scores` wrote. Raises: InputError: scores that are not finite, naming the poses."""
    with Path(path).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if bad := [r["pose"] for r in rows if not np.isfinite(float(r["opacity"]))]:
        raise InputError(f"{path}: the scores of {', '.join(bad[:5])} are not finite")
    return [
        Scored(Pose(r["pose"], float(r["elevation"]), float(r["azimuth"]), float(r["radius"])), float(r["opacity"]))
        for r in rows
    ]


def to_json(chosen: list[Pose], policy: str, k: int) -> dict:
    """The content of poses.json: what was asked, and the poses in the order they were chosen."""
    return {"policy": policy, "k": k, "poses": [asdict(pose) for pose in chosen]}
