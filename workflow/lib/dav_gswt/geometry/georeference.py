"""Where a scene lies on the earth: world coordinates to latitude, longitude and altitude on WGS84, and back.

Exact at any distance: the world is a frame of east, north and up that touches the earth at the scene's origin.
Altitudes above sea level are taken for heights above the ellipsoid: that moves places by at most 16 mm a kilometre.
"""

from dataclasses import astuple, dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from pyproj import Transformer
from pyproj.enums import TransformDirection


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
        east, north = (metres[:, :2] @ self.turn.T).T
        longitude, latitude, altitude = self._to_local.transform(
            east, north, metres[:, 2], direction=TransformDirection.INVERSE
        )
        return np.stack([latitude, longitude, altitude], axis=1)

    def to_world(self, places: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        """World coordinates of latitudes, longitudes and altitudes."""
        latitude, longitude, altitude = np.asarray(places, float).T
        local = np.stack(self._to_local.transform(longitude, latitude, altitude), axis=1)
        return np.concatenate([local[:, :2] @ self.turn, local[:, 2:]], axis=1) / self.metres_per_unit

    @property
    def to_geocentric(self) -> Float[Array, "4 4"]:
        """Takes the world's (x, y, z, 1) to metres from the earth's centre (EPSG:4978), and 1."""
        a, b = np.radians([self.latitude, self.longitude])
        east = np.array([-np.sin(b), np.cos(b), 0.0])
        up = np.array([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)])
        local = np.stack([east, np.cross(up, east), up], axis=1)
        local[:, :2] = local[:, :2] @ self.turn
        cart = Transformer.from_pipeline("+proj=cart +ellps=WGS84")
        matrix = np.eye(4)
        matrix[:3, :3] = self.metres_per_unit * local
        matrix[:3, 3] = cart.transform(self.longitude, self.latitude, self.altitude)
        return matrix

    @cached_property
    def _to_local(self) -> Transformer:
        """Longitude and latitude in degrees and altitude to metres east, north and up of the origin."""
        return Transformer.from_pipeline(
            "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84 "
            f"+step +proj=topocentric +ellps=WGS84 +lat_0={self.latitude!r} +lon_0={self.longitude!r} "
            f"+h_0={self.altitude!r}"
        )
