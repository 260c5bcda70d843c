"""The axes of a rig: cameras at their positions, and limits.

The axes are pan (azimuth) and tilt (elevation) in degrees, and radius, the distance to the exemplar's centre in
millimetres. All axes of a move begin and end together, so a move is a straight line in their space and stays within
limits that hold at both ends.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera

AXES = ("pan", "tilt", "radius")
TURN = 360.0
TOLERANCE = 2.0  # degrees between a pose and how the rig holds its camera
SLACK = np.array([0.5, 0.5, 2.0])  # degrees, degrees, millimetres: tolerance of the reached position

Axes = Float[Array, "3"]
AxisLimits = Float[Array, "3 2"]  # lowest and highest value of each axis
AxisRanges = Mapping[str, Sequence[float | int]]  # of the config: lowest and highest value by axis
UNLIMITED = np.array([[-np.inf, np.inf]] * 3)


@dataclass(frozen=True)
class Mount:
    """Position of a rig in the scene. centre: what it turns about. millimetres: per world unit."""

    centre: Float[Array, "3"]
    millimetres: float

    def axes_of(self, camera: Camera) -> Axes:
        """Axes at which the rig holds this camera; pan from 0 to 360.

        The pan follows from the camera's x axis, which is defined also straight above. Rounded to 0.001, the resolution
        of the protocol.
        """
        out = camera.centre - self.centre
        radius = float(np.linalg.norm(out))
        elevation = np.degrees(np.arcsin(np.clip(out[2] / max(radius, 1e-12), -1, 1)))
        azimuth = np.degrees(np.arctan2(-camera.rotation[0, 0], camera.rotation[0, 1]))
        axes = [azimuth % TURN, elevation, self.millimetres * radius]
        return np.round(axes, 3)

    def camera_at(self, axes: Axes, like: Camera) -> Camera:
        """Camera at a position of the axes, with the lens of `like`."""
        pan, tilt, radius = axes
        elevation = np.clip(tilt, -90.0, 90.0)  # a rig straight above reports a little too much
        posed = camera_layouts.orbit(
            elevation, pan, radius / self.millimetres, self.centre, like.width, like.height, 60.0
        )
        return replace(like, rotation=posed.rotation, translation=posed.translation)

    def find_place(self, camera: Camera, limits: AxisLimits, pan: float) -> Axes | str:
        """The axes at which the rig can hold a camera, at the whole turn nearest to `pan`, or why there are none."""
        axes = self.axes_of(camera)
        held = self.camera_at(axes, camera).rotation
        angle = np.degrees(np.arccos(np.clip((np.trace(held.T @ camera.rotation) - 1) / 2, -1, 1)))
        if angle > TOLERANCE:
            return f"it is turned {angle:.1f} degrees away from how the rig looks: at the exemplar's centre, upright"
        return choose_turn(limits, axes, pan)


def combine_limits(limits: AxisRanges, device: AxisLimits) -> AxisLimits:
    """Intersect the limits of the config and of the rig.

    Raises: InputError: a range from high to low, or limits without overlap.
    """
    requested = np.array([limits[axis] for axis in AXES], float)
    both = np.stack([np.maximum(requested[:, 0], device[:, 0]), np.minimum(requested[:, 1], device[:, 1])], 1)
    if empty := [axis for axis, (low, high) in zip(AXES, both, strict=True) if not low <= high]:
        raise InputError(
            f"config: rig: limits: {empty[0]} goes from high to low, or nothing of it is within what the rig itself "
            "allows"
        )
    return both


def find_violation(limits: AxisLimits, place: Axes) -> str | None:
    """Say why the rig cannot stand at a position; None if it can."""
    for axis, value, (low, high) in zip(AXES, place, limits, strict=True):
        if not low <= value <= high:
            return f"{axis} {value:g} is outside {low:g} to {high:g}"
    return None


def choose_turn(limits: AxisLimits, target: Axes, pan: float) -> Axes | str:
    """A position at the whole turn of its pan within the limits that is nearest to `pan`, or why there is none."""
    low, high = limits[0]
    turns = range(int(np.ceil((low - target[0]) / TURN)), int(np.floor((high - target[0]) / TURN)) + 1)
    if not turns:
        return f"pan {target[0]:g}, also a turn on, is outside {low:g} to {high:g}"
    place = min((target + [TURN * n, 0.0, 0.0] for n in turns), key=lambda each: abs(each[0] - pan))
    return find_violation(limits, place) or place
