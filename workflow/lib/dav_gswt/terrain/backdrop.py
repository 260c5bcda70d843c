"""Backdrop of the terrain: sky, far ground, and the transition of the last tiles into it; on a plane and a planet."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.terrain.choice import Vector
from dav_gswt.terrain.draw_order import finer_share
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.far_ground import HAZE, FarColours, FarGround, lit
from dav_gswt.terrain.heights import FlatSurface, Slope, Sphere

FADE = 0.5  # share of the reach at which the transition begins
CLIMB = 3.0  # times the reach on the ground by which the reach grows with the eye's height over a planet, at most
AIR = 0.12  # height at which the sky of a planet is 1/e as bright, as a share of its radius
NO_END = 1e30  # distance of the last tiles where they reach the horizon
LOWEST = 1e-4  # least sine of the angle of the last tiles below the horizon


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
    def for_eye(terrain: EndlessTerrain, eye: Vector, sky: Sky, ground_colour: Sequence[float] | Array) -> "Backdrop":
        """The backdrop that an eye sees behind a terrain."""
        zenith, horizon, ground = (np.asarray(c, np.float32) for c in (sky.zenith, sky.horizon, ground_colour))
        if isinstance(sphere := terrain.heights, Sphere):
            far, reach, radius = float(np.linalg.norm(eye)), find_reach(terrain, sphere, eye), sphere.radius
            height = max(far - radius, 0.0)
            square = height * (2 * radius + height)  # of the distance to the horizon
            dip = float(np.sqrt(square)) / far
            if reach * reach >= square:
                return SphereBackdrop(zenith, horizon, ground, NO_END, LOWEST, eye, dip, radius)
            low = max((square + reach * reach) / (2 * far * reach) - dip, LOWEST)
            return SphereBackdrop(zenith, horizon, ground, reach, low, eye, dip, radius)
        end, (lowest, _, _) = terrain.reach * terrain.side, terrain.heights.bounds
        low = (eye[2] - lowest) / end
        if isinstance(terrain.heights, FlatSurface):
            return Backdrop(zenith, horizon, ground, end, low)
        colours = FarColours(ground, horizon, end)
        rings = FarGround.around(eye, terrain.heights, colours)
        return RoughBackdrop(zenith, horizon, lit(ground, np.zeros(2)), end, low, colours, rings)

    def colours_along(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        """Colours in directions of any length."""
        rise = (directions[..., 2] / np.linalg.norm(directions, axis=-1))[..., None]
        above = self.horizon + (self.zenith - self.horizon) * np.clip(rise, 0, 1) ** 0.5
        below = self.ground + (self.horizon - self.ground) * self.haze_below(rise)
        return np.where(rise > 0, above, below).astype(np.float32)

    def haze_below(self, rise: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Share of the horizon's colour in directions below it. rise: sine of the angle above it."""
        return np.exp(np.clip(rise, -1, 0) / (0.3 * self.low))

    def colours_behind(self, to: Float[Array, "n 3"], slope: Slope) -> Float32[Array, "n 3"]:
        """Colours that distant Gaussians go over into. to: from the eye. slope: of the surface."""
        return self.colours_along(to)

    def blend_far(self, field: GaussianField, slope: Slope) -> GaussianField:
        """Blend the colours of distant Gaussians (positions relative to the eye) into the backdrop.

        Colours are blended, not opacities: a stack of fading Gaussians would stay opaque until the very end.
        """
        to = field.means.astype(float)
        distance = np.linalg.norm(to, axis=1)
        share = 1 - finer_share(distance, 0.5 * (self.end + self.begin), 0.5 * (self.end - self.begin), True)
        if not share.any():
            return field
        sh = field.sh.copy()
        sh[:, 0] += share[:, None].astype(np.float32) * (rgb_to_sh(self.colours_behind(to, slope))[:, 0] - sh[:, 0])
        return replace(field, sh=sh)


@dataclass(frozen=True)
class RoughBackdrop(Backdrop):
    """Hills that fade into haze, before a plane through the lowest ground, whose haze ends at the horizon."""

    colours: FarColours
    rings: FarGround

    def haze_below(self, rise: Float[Array, "*n"]) -> Float[Array, "*n"]:
        return -np.expm1(self.low / (HAZE * np.minimum(rise, -1e-6)))

    def colours_behind(self, to: Float[Array, "n 3"], slope: Slope) -> Float32[Array, "n 3"]:
        return self.colours.at(np.linalg.norm(to, axis=1), slope)

    def colours_along(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        return self.rings.paint(directions, super().colours_along(directions))


@dataclass(frozen=True)
class SphereBackdrop(Backdrop):
    """Sky that thins out with height, and the horizon of a planet.

    eye: from the planet's middle. dip: sine of the angle of the horizon below the level. radius: of the ground.
    """

    eye: Vector
    dip: float
    radius: float

    @property
    def begin(self) -> float:
        """Half-way from the ground below to the last tiles."""
        return 0.5 * (max(float(np.linalg.norm(self.eye)) - self.radius, 0.0) + self.end)

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


def find_reach(terrain: EndlessTerrain, sphere: Sphere, eye: Vector) -> float:
    """Distance to the last tiles of a planet: longer from above, where more of the ground is in view."""
    reach = terrain.reach * terrain.side
    return reach + min(max(float(np.linalg.norm(eye)) - sphere.radius, 0.0), CLIMB * reach)
