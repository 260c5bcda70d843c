"""The axes of a rig: cameras at their positions, limits and no-go zones.

The axes are pan (azimuth) and tilt (elevation) in degrees, and radius, the distance to the exemplar's centre in
millimetres. All axes of a move begin and end together, so a move is a straight line in their space, and whether it
meets a box is exact. A pose that no straight move reaches is refused.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame

AXES = ("pan", "tilt", "radius")
TURN = 360.0
TOLERANCE = 2.0  # degrees between a pose and how the rig holds its camera
SLACK = np.array([0.5, 0.5, 2.0])  # degrees, degrees, millimetres: tolerance of the reached position

Axes = Float[Array, "3"]
AxisRanges = Mapping[str, Sequence[float | int]]  # of the config: lowest and highest value by axis


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

    def find_violation(self, camera: Camera) -> str | None:
        """Say why no position of the axes gives this camera's orientation; None if one does."""
        axes = self.axes_of(camera)
        if not axes[2] > 0:
            return "it is at the centre that the rig turns about"
        held = self.camera_at(axes, camera).rotation
        angle = np.degrees(np.arccos(np.clip((np.trace(held.T @ camera.rotation) - 1) / 2, -1, 1)))
        if angle <= TOLERANCE:
            return None
        return f"it is turned {angle:.1f} degrees away from how the rig looks: at the exemplar's centre, upright"


def build_mount(rig: Mapping[str, Any], frame: SceneFrame) -> Mount:
    """The mount of the config's `rig`."""
    return Mount(frame.exemplar.centre, float(rig["millimetres"]))


@dataclass(frozen=True)
class RigLimits:
    """What a rig may do.

    limits: lowest and highest value of each axis. zones: boxes that no position or move may touch, widened by SLACK and
    repeated for every turn of the pan within the limits. names: of the zones.
    """

    limits: Float[Array, "3 2"]
    zones: Float[Array, "n 3 2"]
    names: tuple[str, ...]


def combine_limits(limits: AxisRanges, no_go: Sequence[AxisRanges], device: Float[Array, "3 2"]) -> RigLimits:
    """Intersect the limits of the config and of the rig. A zone that omits an axis covers its whole range.

    Raises: InputError: a range from high to low, or limits without overlap.
    """
    for name, table in [("limits", limits), *((f"no_go {i}", zone) for i, zone in enumerate(no_go, 1))]:
        if wrong := [axis for axis in AXES if axis in table and not table[axis][0] <= table[axis][1]]:
            raise InputError(f"config: rig: {name}: {wrong[0]} goes from high to low; the lower end comes first")
    requested = np.array([limits[axis] for axis in AXES], float)
    both = np.stack([np.maximum(requested[:, 0], device[:, 0]), np.minimum(requested[:, 1], device[:, 1])], 1)
    if empty := [axis for axis, (low, high) in zip(AXES, both, strict=True) if not low <= high]:
        raise InputError(f"config: rig: limits: {empty[0]}: nothing of it is within what the rig itself allows")
    zones, names = [], []
    for i, zone in enumerate(no_go, 1):
        box = np.array([zone.get(axis, (-np.inf, np.inf)) for axis in AXES], float) + SLACK[:, None] * [-1, 1]
        turns = _whole_turns(both[0, 0] - box[0, 1], both[0, 1] - box[0, 0]) if np.isfinite(box[0]).all() else [0]
        zones += [box + [[TURN * n], [0.0], [0.0]] for n in turns]
        names += [f"no_go {i}"] * len(turns)
    return RigLimits(both, np.array(zones).reshape(-1, 3, 2), tuple(names))


def _whole_turns(low: float, high: float) -> Sequence[int]:
    return range(int(np.ceil(low / TURN)), int(np.floor(high / TURN)) + 1)


def find_violation(there: RigLimits, place: Axes) -> str | None:
    """Say why the rig cannot stand at a position; None if it can."""
    for axis, value, (low, high) in zip(AXES, place, there.limits, strict=True):
        if not low <= value <= high:
            return f"{axis} {value:g} is outside {low:g} to {high:g}"
    if (inside := _touched_zones(there, place, place)).any():
        return f"it lies in {there.names[int(np.argmax(inside))]}"
    return None


def _touched_zones(there: RigLimits, a: Axes, b: Axes) -> Bool[Array, "n"]:
    """Which zones the straight move from a to b touches (slab test)."""
    low, high, step = there.zones[..., 0] - a, there.zones[..., 1] - a, b - a
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first, last = np.minimum(low / step, high / step), np.maximum(low / step, high / step)
    within = (low <= 0) & (high >= 0)
    first = np.where(step == 0, np.where(within, -np.inf, np.inf), first)
    last = np.where(step == 0, np.where(within, np.inf, -np.inf), last)
    return np.maximum(first.max(1), 0) <= np.minimum(last.min(1), 1)


def list_turns(there: RigLimits, target: Axes, pan: float) -> list[Axes]:
    """A position with its pan at every whole turn within the limits, the nearest to `pan` first."""
    low, high = there.limits[0] - target[0]
    places = [target + [TURN * n, 0.0, 0.0] for n in _whole_turns(low, high)]
    return sorted(places, key=lambda place: abs(place[0] - pan))


def plan_route(there: RigLimits, a: Axes, target: Axes) -> list[Axes] | str:
    """Stops from a to a position at any turn of its pan, or why it cannot be reached."""
    places = list_turns(there, target, a[0])
    if not places:
        low, high = there.limits[0]
        return f"pan {target[0]:g}, also a turn on, is outside {low:g} to {high:g}"
    violations = [find_violation(there, place) for place in places]
    if violations[0] is not None and all(violations):
        return violations[0]
    for place, why in zip(places, violations, strict=True):
        if not why and not _touched_zones(there, a, place).any():
            return [] if np.array_equal(a, place) else [place]
    return "the straight move there crosses a no_go"
