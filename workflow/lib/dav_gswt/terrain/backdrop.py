"""Backdrop of the terrain: sky, far ground, and the transition of the last tiles into it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.weights import finer_share

FADE = 0.5  # share of the reach at which the transition begins


@dataclass(frozen=True)
class Backdrop:
    """Sky colours by elevation, and ground of the mean colour that pales towards the horizon.

    end: distance at which the transition of the last tiles is complete. low: sine of the angle below the horizon there.
    """

    zenith: Float32[Array, "3"]
    horizon: Float32[Array, "3"]
    ground: Float32[Array, "3"]
    end: float
    low: float

    @property
    def begin(self) -> float:
        """Distance at which the transition begins."""
        return FADE * self.end

    @staticmethod
    def for_eye(
        terrain: EndlessTerrain, eye: Float[Array, "3"], sky: Sky, ground_colour: Sequence[float] | Array
    ) -> "Backdrop":
        end = terrain.reach * terrain.side
        zenith, horizon, ground = (np.asarray(c, np.float32) for c in (sky.zenith, sky.horizon, ground_colour))
        return Backdrop(zenith, horizon, ground, end, (eye[2] - terrain.heights.low) / end)

    def colours_along(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        """Colours in directions of any length."""
        rise = (directions[..., 2] / np.linalg.norm(directions, axis=-1))[..., None]
        above = self.horizon + (self.zenith - self.horizon) * np.clip(rise, 0, 1) ** 0.5
        below = self.ground + (self.horizon - self.ground) * np.exp(np.clip(rise, -1, 0) / (0.3 * self.low))
        return np.where(rise > 0, above, below).astype(np.float32)

    def blend_far(self, field: GaussianField) -> GaussianField:
        """Blend the colours of distant Gaussians (positions relative to the eye) into the backdrop.

        Colours are blended, not opacities: a stack of fading Gaussians would stay opaque until the very end.
        """
        to = field.means.astype(float)
        distance = np.linalg.norm(to, axis=1)
        share = 1 - finer_share(distance, 0.5 * (self.end + self.begin), 0.5 * (self.end - self.begin), True)
        if not share.any():
            return field
        sh = field.sh.copy()
        sh[:, 0] += share[:, None].astype(np.float32) * (rgb_to_sh(self.colours_along(to))[:, 0] - sh[:, 0])
        return replace(field, sh=sh)
