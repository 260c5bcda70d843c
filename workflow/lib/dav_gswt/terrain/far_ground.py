"""Far ground of planes that are not flat: hills that fade into haze, from the last tiles to the horizon.

Rings of points about the eye lie on the surface; the viewer's `draw/far_ground.js` draws them as a mesh. Detail that
the rings are too coarse for is left out, so that silhouettes keep their shapes when the eye moves.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.terrain.choice import Floats, Vector
from dav_gswt.terrain.heights import HeightField
from dav_gswt.terrain.light import Light, relight

RINGS, AZIMUTHS = 64, 288
NEAREST, FARTHEST = 0.5, 12.5  # radii of the first and the last ring, over the distance of the last tiles
HAZE = 2.5  # over the same: distance that leaves 1/e of the ground's colour
SPACING = 0.0525  # from ring to ring, over the radius
SINK = 0.005  # share of the distance by which rings lie below tiles, which would not hide all of them


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
