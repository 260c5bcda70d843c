"""Where the sun stands, by time and place."""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

import numpy as np

COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
LOWEST = 3.0  # elevation in degrees. A lower sun casts no clear shadows, or the clock is wrong
APART = 2.0  # hours between photos, from which their light differs
Clock = Literal["gps", "offset", "assumed"]  # the surest first


def name_direction(azimuth: float) -> str:
    """The nearest of eight compass directions. azimuth: degrees clockwise from north."""
    return COMPASS[round(azimuth / 45) % 8]


@dataclass(frozen=True)
class CapturedSun:
    """Where the sun stood when a scene was photographed, by the photos' EXIF.

    Attributes:
        elevation, azimuth: degrees above the horizon, and clockwise from true north.
        time: of the photo in the middle, UTC, ISO 8601.
        clock: what the time is known by: GPS, EXIF with its time zone, or EXIF in an assumed one.
        zone: hours east of Greenwich of EXIF's time; 0 for GPS.
        hours: from the first photo to the last.
    """

    elevation: float
    azimuth: float
    time: str
    clock: Clock
    zone: float
    hours: float

    def describe(self) -> str:
        """Where the sun stood and how that is known, for a sentence."""
        by = "GPS" if self.clock == "gps" else "EXIF"
        said = f"the sun stood {self.elevation:.0f} degrees high in the {name_direction(self.azimuth)}"
        said += f", from the photos' {by} time"
        if self.clock == "assumed":
            said += f"; assumed zone UTC{self.zone:+g}, without daylight saving"
        if self.hours > APART:
            said += f"; of photos that were taken over {self.hours:.0f} hours the middle one counts"
        return said


def locate_sun(time: datetime, latitude: float, longitude: float) -> tuple[float, float]:
    """Elevation and azimuth (clockwise from north) of the sun's centre, at a place north and east; all in degrees.

    The Astronomical Almanac's formula (Michalsky 1988): within 0.01 degrees from 1950 to 2050. Refraction, which lifts
    the sun by 0.25 degrees at 3 degrees above the horizon, is left out. time: with its zone.
    """
    days = (time - datetime(2000, 1, 1, 12, tzinfo=UTC)).total_seconds() / 86400
    anomaly = np.radians(357.528 + 0.9856003 * days)
    along = np.radians(280.460 + 0.9856474 * days + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2 * anomaly))
    tilt, north = np.radians([23.439 - 0.0000004 * days, latitude])
    ascension = np.arctan2(np.cos(tilt) * np.sin(along), np.cos(along))
    up = np.sin(tilt) * np.sin(
        along
    )  # part of the unit vector towards the sky's north pole; across: towards its equator
    across = np.sqrt(1 - up**2)
    hour = np.radians(280.46062 + 360.98564737 * days + longitude) - ascension
    height = np.sin(north) * up + np.cos(north) * across * np.cos(hour)
    azimuth = np.arctan2(-across * np.sin(hour), np.cos(north) * up - np.sin(north) * across * np.cos(hour))
    return float(np.degrees(np.arcsin(np.clip(height, -1, 1)))), float(np.degrees(azimuth) % 360)
