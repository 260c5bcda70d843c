"""Limits and no-go zones of a rig in the space of its axes, and paths around the zones.

All axes of a move begin and end together, so a move is a straight line in this space, and whether it meets a box is
exact. If the straight path is blocked, three moves are tried: one axis moves aside, all move, the axis moves back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError

AXES = ("pan", "tilt", "radius")
TURN = 360.0
SLACK = np.array([0.5, 0.5, 2.0])  # degrees, degrees, millimetres: tolerance of the reached position
BESIDE = 0.01  # distance at which a path passes a zone; zones are widened by SLACK before

Axes = Float[Array, "3"]
AxisRanges = Mapping[str, Sequence[float | int]]  # of the config: lowest and highest value by axis


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
        for turned in _repeat_zone(box, both[0]):
            zones.append(turned)
            names.append(f"no_go {i}")
    return RigLimits(both, np.array(zones).reshape(-1, 3, 2), tuple(names))


def _repeat_zone(box: Float[Array, "3 2"], pans: Float[Array, "2"]) -> list[Float[Array, "3 2"]]:
    """Repeat a zone at every whole turn of the pan within its range: the rig is at the same place there."""
    if not np.isfinite(box[0]).all():
        return [box]
    turns = range(int(np.ceil((pans[0] - box[0, 1]) / TURN)), int(np.floor((pans[1] - box[0, 0]) / TURN)) + 1)
    return [box + [[TURN * n], [0.0], [0.0]] for n in turns]


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


def find_path(there: RigLimits, a: Axes, b: Axes) -> list[Axes] | None:
    """Stops of the shortest free path from a to b, b last; None if no tried path is free.

    Tried are the straight path and those that move aside along one axis. No stop if a equals b.
    """
    if np.array_equal(a, b):
        return []
    if _is_free(there, [a, b]):
        return [b]
    aside = []
    for axis in (2, 1, 0):
        for value in _side_values(there, axis):
            there_and_back = [a, _replace_axis(a, axis, value), _replace_axis(b, axis, value), b]
            stops = [p for p, q in pairwise(there_and_back) if not np.array_equal(p, q)] + [b]
            if _is_free(there, stops):
                aside.append(stops[1:])
    return min(aside, key=lambda stops: _path_length(there, [a, *stops]), default=None)


def list_turns(there: RigLimits, target: Axes, pan: float) -> list[Axes]:
    """A position with its pan at every whole turn within the limits, the nearest to `pan` first."""
    low, high = there.limits[0]
    found = range(int(np.ceil((low - target[0]) / TURN)), int(np.floor((high - target[0]) / TURN)) + 1)
    places = [_replace_axis(target, 0, target[0] + TURN * n) for n in found]
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
    paths = (find_path(there, a, place) for place, why in zip(places, violations, strict=True) if not why)
    return next((stops for stops in paths if stops is not None), "every path there that was tried crosses a no_go")


def _side_values(there: RigLimits, axis: int) -> list[float]:
    """Values of an axis at which a path may pass: the ends of its range, and just beside each zone."""
    low, high = there.limits[axis]
    edges = np.concatenate([[low, high], there.zones[:, axis, 0] - BESIDE, there.zones[:, axis, 1] + BESIDE])
    edges = np.round(edges[np.isfinite(edges)], 3)
    return sorted({float(v) for v in edges if low <= v <= high})


def _is_free(there: RigLimits, stops: list[Axes]) -> bool:
    return not any(_touched_zones(there, p, q).any() for p, q in pairwise(stops))


def _path_length(there: RigLimits, stops: list[Axes]) -> float:
    """Length of a path in shares of the axes' ranges, so that degrees and millimetres can be added."""
    span = np.maximum(there.limits[:, 1] - there.limits[:, 0], 1e-9)
    return float(sum(np.linalg.norm((q - p) / span) for p, q in pairwise(stops)))


def _replace_axis(place: Axes, axis: int, value: float) -> Axes:
    changed = place.copy()
    changed[axis] = value
    return changed
