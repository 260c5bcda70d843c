"""Orders: the splats of a tile from back to front, for a few viewing directions.

A viewer draws a tile in the order whose direction is nearest to its own. It sorts each order once, when it first needs
it, and keeps it. How many directions that takes is measured (`direction_search`). Uncertain tiles use all azimuths, the
others every second one (the paper's "uncertainty-guided caching").
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, UInt32
from numpy import ndarray as Array


@dataclass(frozen=True)
class DirectionRings:
    """Viewing directions: rings of `azimuths` each, at elevations in degrees below the horizon, and straight down.

    Only uncertain tiles keep all; the others keep every second azimuth.
    """

    elevations: tuple[float, ...] = (20.0,)
    azimuths: int = 16

    def directions(self) -> Float[Array, "d 3"]:
        """Unit vectors, ring after ring, each from the east to the north; straight down comes last."""
        azimuth = 2 * np.pi * np.arange(self.azimuths) / self.azimuths
        rings = [unit_vectors(azimuth, np.radians(down)) for down in self.elevations]
        return np.concatenate([*rings, [[0.0, 0.0, -1.0]]])

    def select_directions(self, uncertainty: float, tau: float) -> list[int]:
        """Indices into directions() that a tile keeps: all if it is uncertain, else every second azimuth.

        Straight down is always kept: of n azimuths on r rings r n + 1 directions or r n / 2 + 1. A tile is uncertain if
        u >= tau and tau < 1: at tau = 0 every tile is, at tau = 1 none, and a larger tau never adds one.
        """
        step = 1 if uncertainty >= tau and tau < 1 else 2
        last = self.azimuths * len(self.elevations)
        return [*(r + k for r in range(0, last, self.azimuths) for k in range(0, self.azimuths, step)), last]


def unit_vectors(azimuth: Float[Array, "n"], down: float) -> Float[Array, "n 3"]:
    """Unit vectors at azimuths from the east to the north, so far below the horizon; in radians."""
    flat = np.stack([np.cos(azimuth), np.sin(azimuth)], 1) * np.cos(down)
    return np.concatenate([flat, np.full((len(azimuth), 1), -np.sin(down))], 1)


def sort_back_to_front(means: Float32[Array, "n 3"], along: Float[Array, "3"]) -> UInt32[Array, "n"]:
    """Indices by falling depth along a viewing direction; of equal depths the smaller index comes first."""
    return np.argsort(-(means.astype(float) @ along), kind="stable").astype(np.uint32)
