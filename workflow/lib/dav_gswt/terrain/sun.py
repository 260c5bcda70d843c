"""The sun and the clear sky: their light in three bands, and the sun's path over a day.

The viewer's `terrain/sun.js` computes the same; tests/golden/light.json holds both to it. Elevations are in degrees
above the horizon, azimuths in degrees clockwise from the terrain's +y. `north` is the azimuth of +y itself, clockwise
from true north.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.geometry.sun import LOWEST  # below, the light no longer changes, and the day leaves such hours out

RAYLEIGH = np.array([0.0496, 0.0987, 0.2267])  # optical depths of air at 0.65, 0.55 and 0.45 micrometres
AEROSOL = np.array([0.0805, 0.1, 0.1298])  # optical depths of clear, dry haze
FORWARD = 0.756  # share of the light scattered by haze that reaches the ground
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SUNRISE, SUNSET = 6.0, 18.0  # hours


@dataclass(frozen=True)
class Sun:
    """A position of the sun. elevation: 0 to 90. azimuth: 0 to 360."""

    elevation: float
    azimuth: float

    @property
    def direction(self) -> Float[Array, "3"]:
        """Unit vector towards the sun."""
        e, a = np.radians(self.elevation), np.radians(self.azimuth)
        return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def measure_light(elevation: float) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Irradiance across the sun's beam, and irradiance of level ground by the sky, over that outside the atmosphere.

    A clear sky after Bird and Hulstrom (1981), with the air mass of Kasten and Young (1989).
    """
    elevation = max(elevation, LOWEST)
    rise = np.sin(np.radians(elevation))
    mass = 1 / (rise + 0.50572 * (elevation + 6.07995) ** -1.6364)
    air, haze = np.exp(-mass * RAYLEIGH), np.exp(-mass * AEROSOL)
    return air * haze, rise * (0.5 * (1 - air) + FORWARD * (1 - haze))


def level_light(elevation: float) -> Float[Array, "3"]:
    """Irradiance of level ground by sun and sky."""
    direct, sky = measure_light(elevation)
    return direct * np.sin(np.radians(max(elevation, LOWEST))) + sky


def find_hour(captured: Sun, north: float = 0.0) -> float:
    """Solar time of the captured sun on the path of `sun_at`."""
    x, y, z = Sun(captured.elevation, captured.azimuth + north).direction
    return float(SUNRISE + np.arctan2(np.hypot(y, z), x) / np.pi * (SUNSET - SUNRISE))


def sun_at(captured: Sun, hour: float, north: float = 0.0) -> Sun:
    """The sun at a solar time, on the path through the captured sun that begins due east and ends due west.

    It is the path of an equinox at the latitude where the captured sun lies on it. Hours at which the sun would be
    lower than LOWEST give the nearest one at which it is not.
    """
    _, y, z = Sun(captured.elevation, captured.azimuth + north).direction
    noon = np.array([0.0, y, z]) / np.hypot(y, z)
    rise = min(np.sin(np.radians(LOWEST)) / noon[2], 1.0)
    first = np.arcsin(rise)
    angle = np.clip((hour - SUNRISE) / (SUNSET - SUNRISE) * np.pi, first, np.pi - first)
    x, y, z = np.cos(angle) * np.array([1.0, 0.0, 0.0]) + np.sin(angle) * noon
    azimuth = (np.degrees(np.arctan2(x, y)) - north) % 360.0
    return Sun(float(np.degrees(np.arctan2(z, np.hypot(x, y)))), float(azimuth))
