"""Interface of capture agents."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from dav_gswt.capture.site import Site
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose
from dav_gswt.photos.capture_record import CapturedPhoto
from dav_gswt.views.candidates import Candidates

RequestedPose = tuple[Pose, Camera]


@dataclass(frozen=True)
class CaptureRequest:
    """Poses to photograph.

    remaining: all candidates that are not used yet, the requested ones included. folder: where the photos go.
    """

    site: Site
    poses: list[RequestedPose]
    remaining: Candidates
    folder: Path


class CaptureAgent(Protocol):
    """Takes the photos of a round."""

    def __call__(self, request: CaptureRequest) -> list[CapturedPhoto]:
        """Write the photos into `request.folder` and return one record per photo.

        Raises: InputError: photos are missing; the message says what to do.
        """
        ...


def view_distance(a: Camera, b: Camera, unit: float) -> float:
    """Distance of two views: between the centres in units of `unit` (the flying height), plus the angle between the
    viewing directions in radians."""
    angle = np.arccos(np.clip(a.forward @ b.forward, -1, 1))
    return float(np.linalg.norm(a.centre - b.centre) / unit + angle)


def photo_name(pose: Pose, i: int, burst: int) -> str:
    """File name of the i-th photo of a pose."""
    return f"{pose.name}.png" if burst == 1 else f"{pose.name}_{i}.png"
