"""Where a rig can go, in the space of its axes: limits, zones where it must never be, and ways between them.

All axes of a move begin and end together, so a move is a straight line in this space, and whether it meets a box is
exact. Where the straight way is barred, three moves may do: one axis goes aside, all go, the axis goes back.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError

AXES = ("pan", "tilt", "radius")
TURN = 360.0
SLACK = np.array([0.5, 0.5, 2.0])  # degrees, degrees, millimetres: how far from its goal a rig may come to stand
BESIDE = 0.01  # how far beside a zone a way passes; zones are widened by SLACK before

Axes = Float[Array, "3"]


@dataclass(frozen=True)
class Reach:
    """limits: lowest and highest of each axis. zones: boxes that no place and no move may touch, widened by SLACK, and
    at every turn of the pan that the limits allow. names: of the zones."""

    limits: Float[Array, "3 2"]
    zones: Float[Array, "n 3 2"]
    names: tuple[str, ...]


def reach(limits: dict, no_go: list[dict], device: Float[Array, "3 2"]) -> Reach:
    """What the config and the rig itself allow, both. An axis that a zone leaves out is barred in its whole length.

    Raises: InputError: a range from high to low, or limits that leave nothing.
    """
    for name, table in [("limits", limits), *((f"no_go {i}", zone) for i, zone in enumerate(no_go, 1))]:
        if wrong := [axis for axis in AXES if axis in table and not table[axis][0] <= table[axis][1]]:
            raise InputError(f"config: rig: {name}: {wrong[0]} goes from high to low; the lower end comes first")
    asked = np.array([limits[axis] for axis in AXES], float)
    both = np.stack([np.maximum(asked[:, 0], device[:, 0]), np.minimum(asked[:, 1], device[:, 1])], 1)
    if empty := [axis for axis, (low, high) in zip(AXES, both, strict=True) if not low <= high]:
        raise InputError(f"config: rig: limits: {empty[0]}: nothing of it is within what the rig itself allows")
    zones, names = [], []
    for i, zone in enumerate(no_go, 1):
        box = np.array([zone.get(axis, (-np.inf, np.inf)) for axis in AXES], float) + SLACK[:, None] * [-1, 1]
        for turned in _turned(box, both[0]):
            zones.append(turned)
            names.append(f"no_go {i}")
    return Reach(both, np.array(zones).reshape(-1, 3, 2), tuple(names))


def _turned(box: Float[Array, "3 2"], pans: Float[Array, "2"]) -> list[Float[Array, "3 2"]]:
    """A zone at every whole turn at which it meets the pan's range: the rig is at the same place there."""
    if not np.isfinite(box[0]).all():
        return [box]
    turns = range(int(np.ceil((pans[0] - box[0, 1]) / TURN)), int(np.floor((pans[1] - box[0, 0]) / TURN)) + 1)
    return [box + [[TURN * n], [0.0], [0.0]] for n in turns]


def trouble(there: Reach, place: Axes) -> str | None:
    """Why the rig cannot stand at a place; None if it can."""
    for axis, value, (low, high) in zip(AXES, place, there.limits, strict=True):
        if not low <= value <= high:
            return f"{axis} {value:g} is outside {low:g} to {high:g}"
    if (inside := _met(there, place, place)).any():
        return f"it lies in {there.names[int(np.argmax(inside))]}"
    return None


def _met(there: Reach, a: Axes, b: Axes) -> Bool[Array, "n"]:
    """Which zones the straight move from a to b touches: those whose slabs it is within all at one time."""
    low, high, step = there.zones[..., 0] - a, there.zones[..., 1] - a, b - a
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first, last = np.minimum(low / step, high / step), np.maximum(low / step, high / step)
    within = (low <= 0) & (high >= 0)
    first = np.where(step == 0, np.where(within, -np.inf, np.inf), first)
    last = np.where(step == 0, np.where(within, np.inf, -np.inf), last)
    return np.maximum(first.max(1), 0) <= np.minimum(last.min(1), 1)


def way(there: Reach, a: Axes, b: Axes) -> list[Axes] | None:
    """The stops of the shortest way from a to b that is known to be free, b the last; None if none is.

    The straight way, or one that goes aside along one axis. No stop where the rig stands at b already. b's pan may be
    turned by whole turns (see `turns`).
    """
    if np.array_equal(a, b):
        return []
    if _free(there, [a, b]):
        return [b]
    aside = []
    for axis in (2, 1, 0):
        for value in _beside(there, axis):
            there_and_back = [a, _with(a, axis, value), _with(b, axis, value), b]
            stops = [p for p, q in pairwise(there_and_back) if not np.array_equal(p, q)] + [b]
            if _free(there, stops):
                aside.append(stops[1:])
    return min(aside, key=lambda stops: _length(there, [a, *stops]), default=None)


def turns(there: Reach, wanted: Axes, pan: float) -> list[Axes]:
    """A place with its pan at every whole turn within the limits, the nearest to `pan` first."""
    low, high = there.limits[0]
    found = range(int(np.ceil((low - wanted[0]) / TURN)), int(np.floor((high - wanted[0]) / TURN)) + 1)
    places = [_with(wanted, 0, wanted[0] + TURN * n) for n in found]
    return sorted(places, key=lambda place: abs(place[0] - pan))


def route(there: Reach, a: Axes, wanted: Axes) -> list[Axes] | str:
    """The stops from a to a place at any turn of its pan, or why it cannot be reached."""
    places = turns(there, wanted, a[0])
    if not places:
        low, high = there.limits[0]
        return f"pan {wanted[0]:g}, also a turn on, is outside {low:g} to {high:g}"
    barred = [trouble(there, place) for place in places]
    if all(barred):
        return barred[0]
    ways = (way(there, a, place) for place, why in zip(places, barred, strict=True) if not why)
    return next((stops for stops in ways if stops is not None), "every way there that was tried crosses a no_go")


def _beside(there: Reach, axis: int) -> list[float]:
    """Values of an axis at which a way may pass: the ends of its range, and just beside each zone."""
    low, high = there.limits[axis]
    edges = np.concatenate([[low, high], there.zones[:, axis, 0] - BESIDE, there.zones[:, axis, 1] + BESIDE])
    edges = np.round(edges[np.isfinite(edges)], 3)
    return sorted({float(v) for v in edges if low <= v <= high})


def _free(there: Reach, stops: list[Axes]) -> bool:
    return not any(_met(there, p, q).any() for p, q in pairwise(stops))


def _length(there: Reach, stops: list[Axes]) -> float:
    """Of a way, as shares of the axes' ranges, so that degrees and millimetres can be added."""
    span = np.maximum(there.limits[:, 1] - there.limits[:, 0], 1e-9)
    return float(sum(np.linalg.norm((q - p) / span) for p, q in pairwise(stops)))


def _with(place: Axes, axis: int, value: float) -> Axes:
    changed = place.copy()
    changed[axis] = value
    return changed
