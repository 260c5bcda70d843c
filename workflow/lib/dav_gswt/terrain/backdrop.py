"""What stands behind the tiles, and how the last of them go over into it."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.terrain.assemble import Terrain
from dav_gswt.terrain.weights import finer

FADE = 0.5  # share of the reach from which tiles go over into what is behind them


@dataclass(frozen=True)
class Backdrop:
    """Sky by elevation, and ground of the mean colour that pales to the horizon.

    end: distance at which the last tiles have gone over into it. low: sine of the angle below the horizon there.
    """

    zenith: Float32[Array, "3"]
    horizon: Float32[Array, "3"]
    ground: Float32[Array, "3"]
    end: float
    low: float

    @staticmethod
    def of(terrain: Terrain, eye: Float[Array, "3"], sky: dict, ground_colour) -> "Backdrop":
        end = terrain.reach * terrain.side
        colours = (np.asarray(c, np.float32) for c in (sky["zenith"], sky["horizon"], ground_colour))
        return Backdrop(*colours, end, (eye[2] - terrain.heights.low) / end)

    def seen_along(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        """Its colours in directions of any length."""
        rise = (directions[..., 2] / np.linalg.norm(directions, axis=-1))[..., None]
        above = self.horizon + (self.zenith - self.horizon) * np.clip(rise, 0, 1) ** 0.5
        below = self.ground + (self.horizon - self.ground) * np.exp(np.clip(rise, -1, 0) / (0.3 * self.low))
        return np.where(rise > 0, above, below).astype(np.float32)

    def over(self, field: GaussianField) -> GaussianField:
        """A field around the eye, its far end gone over into what is behind it: no edge shows where tiles end.

        Colours do, not opacities: a stack of fading ones would stay opaque until the very end.
        """
        to = field.means.astype(float)
        share = 1 - finer(np.linalg.norm(to, axis=1), 0.5 * (1 + FADE) * self.end, 0.5 * (1 - FADE) * self.end, True)
        if not share.any():
            return field
        sh = field.sh.copy()
        sh[:, 0] += share[:, None].astype(np.float32) * (rgb_to_sh(self.seen_along(to))[:, 0] - sh[:, 0])
        return replace(field, sh=sh)
