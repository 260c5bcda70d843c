"""Candidate poses: places on a hemisphere over the exemplar, as (elevation, azimuth, radius) and a camera each."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame


@dataclass(frozen=True)
class Pose:
    """A camera's place about the exemplar's centre: degrees, degrees, world units. name: unique in its scene."""

    name: str
    elevation: float
    azimuth: float
    radius: float


def pose_of_camera(name: str, camera: Camera, frame: SceneFrame) -> Pose:
    """Where a camera stands, as a pose about the exemplar's centre."""
    x, y, z = camera.centre - frame.exemplar.centre
    radius = float(np.sqrt(x * x + y * y + z * z))
    elevation = float(np.degrees(np.arcsin(np.clip(z / max(radius, 1e-12), -1, 1))))
    return Pose(name, elevation, float(np.degrees(np.arctan2(y, x)) % 360), radius)


def pose_offset(pose: Pose) -> Float[Array, "3"]:
    """The pose's position relative to the exemplar's centre."""
    e, a = np.radians(pose.elevation), np.radians(pose.azimuth)
    return pose.radius * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def select_farthest_poses(candidates: list[Pose], count: int, taken: Float[Array, "m 3"] | None = None) -> list[int]:
    """`count` of the candidates, or all, each the farthest from those before and from the places taken; ties by index.

    taken: relative to the exemplar's centre.
    """
    places = np.array([pose_offset(p) for p in candidates]).reshape(-1, 3)
    nearest, chosen = np.full(len(places), np.inf), []
    for at in [] if taken is None else taken:
        nearest = np.minimum(nearest, np.linalg.norm(places - at, axis=1))
    for _ in range(min(count, len(places))):
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(places - places[chosen[-1]], axis=1))
        nearest[chosen[-1]] = -np.inf
    return chosen
