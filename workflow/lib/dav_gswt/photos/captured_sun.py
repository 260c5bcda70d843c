"""Where the sun stood when photos were taken, by their EXIF and the place of the scene."""

import logging
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import get_args

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.sun import LOWEST, CapturedSun, Clock, locate_sun
from dav_gswt.photos.photo_files import read_utc_time

_log = logging.getLogger(__name__)


def find_sun(paths: Iterable[Path], place: Georeference) -> CapturedSun | None:
    """Find the sun at the median time of the photos. If it is not known, return None and log the reason.

    If the photos know their times in different ways (`Clock`), only the most frequent way is used, and among equally
    frequent ones the most reliable.
    """
    times = [time for path in paths if (time := read_utc_time(path, place.longitude))]
    if not times:
        _log.info("light: no photo says when it was taken: the sun is not known")
        return None
    counts = Counter(time.clock for time in times)
    clock: Clock = max(get_args(Clock), key=lambda each: counts[each])
    times = sorted((time for time in times if time.clock == clock), key=lambda time: time.utc)
    middle = times[len(times) // 2]
    hours = (times[-1].utc - times[0].utc).total_seconds() / 3600
    elevation, azimuth = locate_sun(middle.utc, place.latitude, place.longitude)
    stamp = f"{middle.utc:%Y-%m-%dT%H:%M:%SZ}"
    if elevation < LOWEST:
        _log.warning("light: at %s the sun stood %.0f degrees high: it is not known where it stood", stamp, elevation)
        return None
    sun = CapturedSun(round(elevation, 2), round(azimuth, 2) % 360, stamp, clock, middle.zone, round(hours, 2))
    _log.info("light: %s", sun.describe())
    return sun
