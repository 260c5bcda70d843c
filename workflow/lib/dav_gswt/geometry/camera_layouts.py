"""Camera layouts: places (elevation, azimuth, radius) about a target, and sets of them.

Elevation is measured from the ground up (90: straight above), azimuth from +x towards +y; both in degrees.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera, pinhole

Place = tuple[float, float, float]  # elevation, azimuth, radius
GOLDEN = np.pi * (3.0 - 5.0**0.5)  # radians between neighbours of a Fibonacci lattice
PLASTIC = 1.2207440846057596  # x^4 = x + 1: base of the quasirandom sequence in three dimensions


def orbit(elevation, azimuth, radius, target, width: int, height: int, fov) -> Camera:
    """The camera at a place, looking at `target`. fov: of the picture's width, degrees.

    The picture's top is up; from straight above it is the side away from the camera's azimuth, which is what the top
    tends to as the elevation tends to 90.
    """
    e, a = np.radians(elevation), np.radians(azimuth % 360.0)
    target = np.asarray(target, float)
    outward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    upward = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])  # of length 1 at every elevation
    return pinhole(target + radius * outward, target, width, height, fov, upward)


def start_ring(n: int, elevation: float, radius: float) -> list[Place]:
    """n places: one straight above, the others evenly around at `elevation`. One alone is the one above."""
    return [(90.0, 0.0, radius)] + ring(n - 1, elevation, radius)


def ring(n: int, elevation: float, radius: float, turn: float = 0.0) -> list[Place]:
    """n places evenly around at `elevation`, the first at azimuth `turn`."""
    return [(elevation, turn + 360.0 * i / n, radius) for i in range(n)]


def hemisphere(n: int, lowest_elevation: float, radius: float, turn: float = 0.0) -> list[Place]:
    """n places, uniform by area between `lowest_elevation` and 90, on a Fibonacci lattice.

    Place i lies at sin(elevation) = 1 - (i + 1/2)/n (1 - sin(lowest)): equal steps of height are equal areas of a
    sphere. turn: turns the whole lattice, degrees.
    """
    low = np.sin(np.radians(lowest_elevation))
    height = 1.0 - (np.arange(n) + 0.5) / max(n, 1) * (1.0 - low)
    azimuth = (np.degrees(np.arange(n) * GOLDEN) + turn) % 360.0
    return [(float(np.degrees(np.arcsin(h))), float(a), radius) for h, a in zip(height, azimuth, strict=True)]


def spread_free(
    n: int, lowest_elevation: float, radii: tuple[float, float], reach: float
) -> list[tuple[Place, tuple[float, float]]]:
    """n places as of `hemisphere`, each about an aim point of its own on the ground: (place, (x, y)).

    Radii (uniform between the two) and aim points (uniform over a square of side `reach` about the target) follow a
    sequence of low discrepancy: Roberts, The Unreasonable Effectiveness of Quasirandom Sequences, 2018 (R3).
    """
    spread = (0.5 + np.outer(np.arange(1, n + 1), PLASTIC ** -np.arange(1.0, 4.0))) % 1.0
    radius = radii[0] + (radii[1] - radii[0]) * spread[:, 2]
    aims = reach * (spread[:, :2] - 0.5)
    return [
        ((elevation, azimuth, float(r)), (float(x), float(y)))
        for (elevation, azimuth, _), r, (x, y) in zip(hemisphere(n, lowest_elevation, 1.0), radius, aims, strict=True)
    ]


def spread_along(places: Float[Array, "m 2"], n: int) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    """n points evenly along a polyline, ends included, and its azimuth there in degrees.

    Raises: ValueError: fewer than two places, or a route without length.
    """
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    if not lengths.sum() > 0:
        raise ValueError("a route needs two places that are apart")
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(0.0, ends[-1], n)
    leg = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(steps) - 1)
    share = (at - ends[leg]) / np.maximum(lengths[leg], 1e-300)
    azimuth = np.degrees(np.arctan2(steps[leg, 1], steps[leg, 0]))
    return places[leg] + share[:, None] * steps[leg], azimuth
