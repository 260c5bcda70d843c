"""The sun by the EXIF of small photos."""

import numpy as np
import OpenImageIO as oiio
import pytest

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos.photo_files import find_sun

GOLDEN = Georeference(39.742476, -105.1786, 1830.0, 0.0, metres_per_unit=1.0)  # of test_sun, at 19:30:30 UTC
SUN = pytest.approx((39.87, 194.34), abs=0.02)
UNSET_GPS = {"GPSDateStamp": "1980:01:06", "GPSTimeStamp": (0.0, 0.0, 0.0)}
NO_GPS = {"GPSDateStamp": "2003:10:17", "GPSTimeStamp": (99.0, 0.0, 0.0)}


def shot(path, **tags):
    """A JPEG with tags of EXIF, or of GPS where a name begins so."""
    spec = oiio.ImageSpec(4, 3, 3, oiio.UINT8)
    for key, value in tags.items():
        name = key.replace("GPS", "GPS:") if key.startswith("GPS") else f"Exif:{key}"
        kind = "string" if isinstance(value, str) else "float[3]"
        spec.attribute(name, oiio.TypeDesc(kind), value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(np.zeros((3, 4, 3), np.uint8))
    file.close()
    return path


@pytest.mark.parametrize(
    ("tags", "clock", "zone"),
    [
        ({"GPSDateStamp": "2003:10:17", "GPSTimeStamp": (19.0, 30.0, 30.0)}, "gps", 0),
        ({"DateTimeOriginal": "2003:10:18 01:00:30", "OffsetTimeOriginal": "+05:30"}, "offset", 5.5),
        ({"DateTimeOriginal": "2003:10:17 12:30:30"}, "assumed", -7),
        ({"DateTimeOriginal": "2003:10:17 12:30:30", "OffsetTimeOriginal": "   :  "}, "assumed", -7),
        ({"DateTimeOriginal": "2003:10:17 12:30:30"} | NO_GPS, "assumed", -7),
        ({"DateTimeOriginal": "2003:10:17 12:30:30"} | UNSET_GPS, "assumed", -7),
    ],
    ids=["GPS", "with a zone", "without a zone", "a blank zone", "no hour of GPS", "GPS before its first fix"],
)
def test_the_time_is_by_gps_or_local_in_the_zone_that_exif_or_else_the_longitude_gives(tmp_path, tags, clock, zone):
    wrong = {"DateTimeOriginal": "2003:10:17 03:00:00"}  # a camera's clock counts after GPS
    sun = find_sun([shot(tmp_path / "a.jpg", **(wrong | tags))], GOLDEN)
    assert sun is not None and (sun.elevation, sun.azimuth) == SUN
    assert (sun.clock, sun.zone, sun.time, sun.hours) == (clock, zone, "2003-10-17T19:30:30Z", 0)
    assert sun.describe().startswith("the sun stood 40 degrees high in the south, from the photos' ")
    assert ("assumed zone UTC-7" in sun.describe()) == (clock == "assumed")


def test_of_photos_hours_apart_the_middle_one_counts(tmp_path, caplog):
    caplog.set_level("INFO")
    hours = (9, 12, 15, 12)
    paths = [shot(tmp_path / f"{k}.jpg", DateTimeOriginal=f"2003:10:17 {h:02}:30:30") for k, h in enumerate(hours)]
    paths.append(shot(tmp_path / "gps.jpg", GPSDateStamp="2003:10:17", GPSTimeStamp=(1.0, 0.0, 0.0)))
    sun = find_sun(paths, GOLDEN)
    assert sun is not None and (sun.elevation, sun.azimuth, sun.hours) == (*SUN.expected, 6.0)
    assert "taken over 6 hours the middle one counts" in caplog.text


@pytest.mark.parametrize(
    ("tags", "said"),
    [
        ({}, "no photo says when"),
        ({"DateTimeOriginal": "1980:01:01 12:00:00"}, "no photo says when"),
        ({"DateTimeOriginal": "0001:01:01 00:00:00"}, "no photo says when"),
        ({"DateTimeOriginal": "9999:12:31 23:59:59"}, "no photo says when"),
        ({"DateTimeOriginal": "9999:12:31 23:59:59", "OffsetTimeOriginal": "-05:00"}, "no photo says when"),
        ({"GPSDateStamp": "9999:12:31", "GPSTimeStamp": (23.0, 59.0, 59.0)}, "no photo says when"),
        (NO_GPS, "no photo says when"),
        ({"DateTimeOriginal": "2003:10:17 23:00:00"}, "at 2003-10-18T06:00:00Z the sun stood -"),
    ],
)
def test_a_time_that_cannot_be_tells_no_sun(tmp_path, caplog, tags, said):
    caplog.set_level("INFO")
    assert find_sun([shot(tmp_path / "a.jpg", **tags)], GOLDEN) is None
    assert said in caplog.text and len(caplog.records) == 1
