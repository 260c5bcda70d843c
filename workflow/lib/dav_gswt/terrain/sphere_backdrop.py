"""Backdrop of a planet: sky that thins out with height, far ground of the mean colour, and the horizon between them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.sphere import Sphere
from dav_gswt.terrain.sphere_cells import find_reach

AIR = 0.12  # height at which the sky is 1/e as bright, as a share of the planet's radius
NO_END = 1e30  # distance of the last tiles where they reach the horizon


@dataclass(frozen=True)
class SphereBackdrop(Backdrop):
    """eye: from the planet's middle. dip: sine of the angle of the horizon below the level. radius: of the ground."""

    eye: Float[Array, "3"]
    dip: float
    radius: float

    @property
    def begin(self) -> float:
        """Half-way from the ground below to the last tiles."""
        return 0.5 * (max(float(np.linalg.norm(self.eye)) - self.radius, 0.0) + self.end)

    @staticmethod
    def for_eye(
        terrain: EndlessTerrain, eye: Float[Array, "3"], sky: Sky, ground_colour: Sequence[float] | Array
    ) -> "SphereBackdrop":
        sphere = terrain.heights
        assert isinstance(sphere, Sphere)
        end, low, dip = find_end(sphere.radius, float(np.linalg.norm(eye)), find_reach(terrain, sphere, eye))
        zenith, horizon, ground = (np.asarray(c, np.float32) for c in (sky.zenith, sky.horizon, ground_colour))
        return SphereBackdrop(zenith, horizon, ground, end, low, eye, dip, sphere.radius)

    def colours_along(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        way = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
        far = np.linalg.norm(self.eye)
        rise = (way @ (self.eye / far))[..., None]
        above = rise + self.dip
        # closest to the ground a ray comes: at the eye if it goes up
        passing = np.where(rise > 0, far, far * np.sqrt(np.maximum(1 - rise * rise, 0))) - self.radius
        air, here = (np.exp(-((np.maximum(h, 0) / (AIR * self.radius)) ** 2)) for h in (passing, far - self.radius))
        share = np.clip(above / (1 + self.dip), 0, 1) ** 0.5
        sky = air * (self.horizon + (self.zenith - self.horizon) * share)
        haze = here * np.exp(np.minimum(above, 0) / (0.3 * self.low))
        below = self.ground + (self.horizon - self.ground) * haze
        return np.where(above > 0, sky, below).astype(np.float32)


def find_end(radius: float, far: float, reach: float) -> tuple[float, float, float]:
    """Distance at which the last tiles are blended into the backdrop, sine of the angle there below the horizon (at
    least 1e-4), and that of the horizon below the level.

    Args:   far: distance of the eye from the planet's middle.
    """
    height = max(far - radius, 0.0)
    square = height * (2 * radius + height)  # of the distance to the horizon
    dip = float(np.sqrt(square)) / far
    if reach * reach >= square:
        return NO_END, 1e-4, dip
    return reach, max((square + reach * reach) / (2 * far * reach) - dip, 1e-4), dip
