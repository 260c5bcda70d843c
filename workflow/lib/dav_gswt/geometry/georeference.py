"""Where a scene lies on the earth: world coordinates to latitude, longitude and altitude on WGS84, and back.

Exact at any distance: the world is a frame of east, north and up that touches the earth at the scene's origin.
Altitudes above sea level are taken for heights above the ellipsoid: that moves places by at most 16 mm a kilometre.
"""

from dataclasses import astuple, dataclass, field

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

EQUATOR = 6378137.0  # metres: WGS84's semi-major axis
FLATTENING = 1 / 298.257223563
ECCENTRICITY2 = FLATTENING * (2 - FLATTENING)  # squared
ROUNDS = 6  # of Bowring's iteration for the latitude; three leave less than a micrometre near the ground


@dataclass(frozen=True)
class Georeference:
    """Where the world's origin lies, in degrees and metres above sea level.

    north: azimuth of the world's +y, degrees clockwise from true north. slope: of the plane z = 0, degrees; in which
    direction is not known.
    """

    latitude: float
    longitude: float
    altitude: float
    north: float
    slope: float = field(default=0.0, kw_only=True)
    metres_per_unit: float

    @property
    def is_on_earth(self) -> bool:
        """Whether all values are finite, the place is no pole and the scale is positive."""
        return bool(np.isfinite(astuple(self)).all() and abs(self.latitude) < 89.9 and self.metres_per_unit > 0)

    @property
    def turn(self) -> Float[Array, "2 2"]:
        """Takes the world's (x, y) to (east, north)."""
        a = np.radians(self.north)
        return np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])

    def azimuth(self, direction: Float[Array, "d"]) -> float:
        """The compass direction, clockwise from true north in degrees, of a direction in the world."""
        east, north = self.turn @ direction[:2]
        return float(np.degrees(np.arctan2(east, north)) % 360)

    def to_earth(self, points: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        """Latitude, longitude and altitude of points of the world."""
        metres = self.metres_per_unit * np.asarray(points, float)
        local = np.concatenate([metres[:, :2] @ self.turn.T, metres[:, 2:]], axis=1)
        at = np.array([[self.latitude, self.longitude, self.altitude]])
        return _geodetic(_geocentric(at) + local @ _axes(self.latitude, self.longitude))

    def to_world(self, places: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        """World coordinates of latitudes, longitudes and altitudes."""
        at = np.array([[self.latitude, self.longitude, self.altitude]])
        offset = _geocentric(np.asarray(places, float)) - _geocentric(at)
        local = offset @ _axes(self.latitude, self.longitude).T
        return np.concatenate([local[:, :2] @ self.turn, local[:, 2:]], axis=1) / self.metres_per_unit


def _axes(latitude: float, longitude: float) -> Float[Array, "3 3"]:
    """East, north and up, as rows, in geocentric coordinates."""
    f, a = np.radians(latitude), np.radians(longitude)
    east = [-np.sin(a), np.cos(a), 0.0]
    north = [-np.sin(f) * np.cos(a), -np.sin(f) * np.sin(a), np.cos(f)]
    return np.array([east, north, [np.cos(f) * np.cos(a), np.cos(f) * np.sin(a), np.sin(f)]])


def _geocentric(places: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Metres from the earth's centre; N is the radius of curvature in the prime vertical."""
    f, a = np.radians(places[:, 0]), np.radians(places[:, 1])
    n = EQUATOR / np.sqrt(1 - ECCENTRICITY2 * np.sin(f) ** 2)
    out = (n + places[:, 2]) * np.cos(f)
    return np.stack([out * np.cos(a), out * np.sin(a), (n * (1 - ECCENTRICITY2) + places[:, 2]) * np.sin(f)], axis=1)


def _geodetic(points: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """The inverse of `_geocentric`. Source: Bowring, Transformation from spatial to geographical coordinates (1976)."""
    out = np.hypot(points[:, 0], points[:, 1])
    polar = EQUATOR * (1 - FLATTENING)
    beta = np.arctan2(points[:, 2], (1 - FLATTENING) * out)
    for _ in range(ROUNDS):
        rise = points[:, 2] + ECCENTRICITY2 / (1 - ECCENTRICITY2) * polar * np.sin(beta) ** 3
        latitude = np.arctan2(rise, out - ECCENTRICITY2 * EQUATOR * np.cos(beta) ** 3)
        beta = np.arctan2((1 - FLATTENING) * np.sin(latitude), np.cos(latitude))
    s = np.sin(latitude)
    height = out * np.cos(latitude) + points[:, 2] * s - EQUATOR * np.sqrt(1 - ECCENTRICITY2 * s**2)
    longitude = np.arctan2(points[:, 1], points[:, 0])
    return np.stack([np.degrees(latitude), np.degrees(longitude), height], axis=1)
