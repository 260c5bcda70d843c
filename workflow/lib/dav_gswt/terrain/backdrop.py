"""Backdrop of the terrain: sky, far ground, and the transition of the last tiles into it; on a plane and a planet.

Beyond the last tiles of planes that are not flat, hills fade into haze. Rings of points about the eye lie on the
surface; the viewer's `draw/far_ground.js` draws them as a mesh. Detail that the rings are too coarse for is left out,
so that silhouettes keep their shapes when the eye moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.terrain.choice import Floats, Vector
from dav_gswt.terrain.draw_order import finer_share
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import FlatSurface, HeightField, Slope, Sphere
from dav_gswt.terrain.light import Light, PlacedLight, relight

RINGS, AZIMUTHS = 64, 288
NEAREST, FARTHEST = 0.5, 12.5  # radii of the first and the last ring, over the distance of the last tiles
HAZE = 2.5  # over the same: distance that leaves 1/e of the ground's colour
SPACING = 0.0525  # from ring to ring, over the radius
SINK = 0.005  # share of the distance by which rings lie below tiles, which would not hide all of them
FADE = 0.5  # share of the reach at which the transition begins
CLIMB = 3.0  # times the reach on the ground by which the reach grows with the eye's height over a planet, at most
AIR = 0.12  # height at which the sky of a planet is 1/e as bright, as a share of its radius
NO_END = 1e30  # distance of the last tiles where they reach the horizon
LOWEST = 1e-4  # least sine of the angle of the last tiles below the horizon


@dataclass(frozen=True)
class FarColours:
    """Colours of distant ground: its own near the eye, the horizon's far away.

    ground: as captured. end: distance of the last tiles. light: None: as captured.
    """

    ground: Float32[Array, "3"]
    horizon: Float32[Array, "3"]
    end: float
    light: Light | None

    def at(self, distance: Floats, slope: Float[Array, "n 2"], visible: Floats | float = 1.0) -> Float32[Array, "n 3"]:
        """Colours at distances from the eye. visible: share of the sun's disc."""
        ground = self.ground if self.light is None else relight(self.ground, self.light.ratio(slope, visible))
        left = np.exp(-distance / (HAZE * self.end))[:, None]
        return (self.horizon + (ground - self.horizon) * left).astype(np.float32)


@dataclass(frozen=True)
class FarGround:
    """Rings about the eye, the nearest first; the last azimuth is the first again.

    tangents: of the angle of a point above the level. colours: of points.
    """

    radii: Float[Array, "rings"]
    tangents: Float[Array, "rings azimuths"]
    colours: Float32[Array, "rings azimuths 3"]

    @staticmethod
    def around(eye: Vector, surface: HeightField, colours: FarColours) -> "FarGround":
        """The rings about an eye."""
        end = colours.end
        radii = end * np.geomspace(NEAREST, FARTHEST, RINGS)
        turn = 2 * np.pi / AZIMUTHS * np.arange(AZIMUTHS)
        x, y = (np.multiply.outer(radii, way(turn)).ravel() for way in (np.cos, np.sin))
        radius = radii.repeat(AZIMUTHS)
        height, slope = surface.smooth_at(x + eye[0], y + eye[1], SPACING * radius)
        height -= eye[2]
        distance = np.hypot(radius, height)
        painted = colours.at(distance, slope)
        height -= SINK * radius * np.clip(5 - 5 * distance / end, 0, 1)
        rows = [v.reshape(RINGS, AZIMUTHS, -1) for v in (height / radius, painted)]
        tangents, painted = (np.concatenate([v, v[:, :1]], 1) for v in rows)
        return FarGround(radii, tangents[..., 0], painted)

    def paint(
        self, directions: Float[Array, "*shape 3"], behind: Float32[Array, "*shape 3"]
    ) -> Float32[Array, "*shape 3"]:
        """Colours of the rings in directions of any length. Rays that meet no ring keep the colours `behind`.

        Between four points of two rings the tangent is interpolated by azimuth; a ray meets the nearest such piece
        whose tangents lie on both sides of its own.
        """
        painted, to = behind.reshape(-1, 3).copy(), directions.reshape(-1, 3)
        with np.errstate(divide="ignore"):
            rise = to[:, 2] / np.hypot(to[:, 0], to[:, 1])
        at = np.flatnonzero((rise > self.tangents.min()) & (rise < self.tangents.max()))  # rays that are still open
        rise = rise[at]
        turn = np.arctan2(to[at, 1], to[at, 0]) * (AZIMUTHS / (2 * np.pi)) % AZIMUTHS
        west = np.minimum(turn.astype(np.int64), AZIMUTHS - 1)
        share = turn - west
        near = _interpolate(self.tangents[0], west, share) - rise
        for ring in range(1, RINGS):
            far = _interpolate(self.tangents[ring], west, share) - rise
            met = near * far <= 0
            if met.any():
                a, b = self.radii[ring - 1] * near[met], self.radii[ring] * far[met]
                across = (a / np.where(a == b, 1, a - b))[:, None]
                one, other = (_interpolate(self.colours[k], west[met], share[met, None]) for k in (ring - 1, ring))
                painted[at[met]] = one + across * (other - one)
                at, west = at[~met], west[~met]
                rise, share, far = rise[~met], share[~met], far[~met]
            near = far
        return painted.reshape(behind.shape)


def _interpolate(row: Array, west: Array, share: Array) -> Array:
    """Values between azimuths."""
    return row[west] + share * (row[west + 1] - row[west])


@dataclass(frozen=True)
class Backdrop:
    """Sky colours by elevation, and ground of the mean colour that pales towards the horizon.

    end: distance at which the transition of the last tiles is complete. low: sine of the angle below the horizon there.
    light: whose sun is in the sky; None: no sun.
    """

    zenith: Float32[Array, "3"]
    horizon: Float32[Array, "3"]
    ground: Float32[Array, "3"]
    end: float
    low: float
    light: Light | None = field(default=None, kw_only=True)

    @property
    def begin(self) -> float:
        """Distance at which the transition begins."""
        return FADE * self.end

    @staticmethod
    def for_eye(terrain: EndlessTerrain, eye: Vector, sky: Sky, ground_colour: Sequence[float] | Array) -> "Backdrop":
        """The backdrop that an eye sees behind a terrain."""
        light, bare = terrain.light and terrain.light.light, np.asarray(ground_colour, np.float32)
        if light:
            sky, ground_colour = light.change_sky(sky), relight(bare, light.ground_ratio)
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
            return Backdrop(zenith, horizon, ground, end, low, light=light)
        colours = FarColours(bare, horizon, end, light)
        rings = FarGround.around(eye, terrain.heights, colours)
        return RoughBackdrop(zenith, horizon, ground, end, low, colours, rings, terrain.light, eye, light=light)

    def colours_along(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        """Colours in directions of any length, without the sun."""
        rise = (directions[..., 2] / np.linalg.norm(directions, axis=-1))[..., None]
        above = self.horizon + (self.zenith - self.horizon) * np.clip(rise, 0, 1) ** 0.5
        below = self.ground + (self.horizon - self.ground) * self.haze_below(rise)
        return np.where(rise > 0, above, below).astype(np.float32)

    def show(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        """Colours of pixels that see in directions of any length."""
        colours = self.colours_along(directions)
        if self.light is None:
            return colours
        rays = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
        return np.where(rays[..., 2:] > 0, self.light.add_sun(colours, rays), colours).astype(np.float32)

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
    placed: PlacedLight | None
    eye: Vector

    def haze_below(self, rise: Float[Array, "*n"]) -> Float[Array, "*n"]:
        return -np.expm1(self.low / (HAZE * np.minimum(rise, -1e-6)))

    def colours_behind(self, to: Float[Array, "n 3"], slope: Slope) -> Float32[Array, "n 3"]:
        seen = self.placed.visible(*(to[:, :2] + self.eye[:2]).T) if self.placed else 1.0
        return self.colours.at(np.linalg.norm(to, axis=1), slope, seen)

    def show(self, directions: Float[Array, "*shape 3"]) -> Float32[Array, "*shape 3"]:
        return self.rings.paint(directions, super().show(directions))


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
