"""Pre-sorted orders: the splats of a tile from back to front, for a few viewing directions.

A viewer takes the order whose direction is nearest to its own and sorts nothing. Tiles in doubt keep twice as many
azimuths ("uncertainty-guided caching"): where the field is unsure its splats overlap more, and a wrong order shows.
"""

import numpy as np
from jaxtyping import Float, Float32, UInt32
from numpy import ndarray as Array

AZIMUTHS = 16  # of a deep tile; the others keep every second one
DOWN = 20.0  # degrees below the horizon: how a walker looks at the ground around


def directions() -> Float[Array, "d 3"]:
    """Unit viewing directions: AZIMUTHS around from east to north, all DOWN degrees down, then straight down."""
    azimuth = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    down = np.radians(DOWN)
    flat = np.stack([np.cos(azimuth), np.sin(azimuth)], 1) * np.cos(down)
    around = np.concatenate([flat, np.full((AZIMUTHS, 1), -np.sin(down))], 1)
    return np.concatenate([around, [[0.0, 0.0, -1.0]]])


def kept(uncertainty: float, tau: float) -> list[int]:
    """Indices into directions() that a tile keeps: all if it is deep, else every second azimuth and straight down.

    Deep is u >= tau for tau < 1: at tau = 0 every tile is, at tau = 1 none, and a larger tau never adds one.
    Raises: ValueError: u or tau is not in [0, 1].
    """
    if not (0 <= uncertainty <= 1 and 0 <= tau <= 1):
        raise ValueError(f"uncertainty {uncertainty} and tau {tau} must lie in [0, 1]")
    deep = uncertainty >= tau and tau < 1
    return [*range(0, AZIMUTHS, 1 if deep else 2), AZIMUTHS]


def back_to_front(means: Float32[Array, "n 3"], along: Float[Array, "3"]) -> UInt32[Array, "n"]:
    """Indices by falling depth along a viewing direction; of equal depths the smaller index comes first."""
    return np.argsort(-(means.astype(float) @ along), kind="stable").astype(np.uint32)
