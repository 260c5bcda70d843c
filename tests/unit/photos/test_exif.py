"""Focal lengths, positions and times from EXIF, the sun by them, names of pictures, photos held upright."""

import struct

import numpy as np
import OpenImageIO as oiio
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos.lenses import undistort_scene_photo
from dav_gswt.photos.photo_files import find_sun, name_pictures, read_capture_time, read_focal_length, read_gps_position


def photo(path, width, height, **tags):
    """A grey JPEG with EXIF tags."""
    spec = oiio.ImageSpec(width, height, 3, oiio.UINT8)
    for key, value in tags.items():
        spec[f"Exif:{key}"] = value
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(np.full((height, width, 3), 128, np.uint8))
    file.close()
    return path


def with_block(path, entries, order="<"):
    """A JPEG whose EXIF block is written byte by byte. entries: {tag: (type, struct format, values)}."""
    plain = photo(path, 400, 300).read_bytes()
    mark = {"<": b"II*\0", ">": b"MM\0*"}[order]
    body = mark + struct.pack(order + "IHHHII", 8, 1, 0x8769, 4, 1, 26) + b"\0" * 4
    table, data, end = b"", b"", 26 + 2 + 12 * len(entries) + 4
    for tag, (kind, form, values) in sorted(entries.items()):
        packed = struct.pack(order + form, *values)
        place = packed.ljust(4, b"\0") if len(packed) <= 4 else struct.pack(order + "I", end + len(data))
        table += struct.pack(order + "HHI", tag, kind, 1) + place
        data += b"" if len(packed) <= 4 else packed
    block = b"Exif\0\0" + body + struct.pack(order + "H", len(entries)) + table + b"\0" * 4 + data
    path.write_bytes(plain[:2] + b"\xff\xe1" + struct.pack(">H", len(block) + 2) + block + plain[2:])
    return path


def test_the_35_mm_equivalent_compares_diagonals(tmp_path):
    # 3:2 like the film itself: 24 mm on 36 x 24 mm is 24 / 36 of the width.
    assert read_focal_length(photo(tmp_path / "a.jpg", 360, 240, FocalLengthIn35mmFilm=24)) == pytest.approx(240, 1e-4)
    assert read_focal_length(photo(tmp_path / "b.jpg", 240, 360, FocalLengthIn35mmFilm=24)) == pytest.approx(240, 1e-4)
    narrow = read_focal_length(photo(tmp_path / "a.jpg", 320, 240, FocalLengthIn35mmFilm=20))
    wide = read_focal_length(photo(tmp_path / "b.jpg", 320, 180, FocalLengthIn35mmFilm=20))
    assert wide == narrow == pytest.approx(20 / 43.2666 * 400, rel=1e-6)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("pitch", [(5, "II", (20000, 2)), (12, "d", (10000.0,))], ids=["rational", "double"])
def test_the_pixel_pitch_counts_before_the_equivalent(tmp_path, order, pitch):
    entries = {0x920A: (5, "II", (254, 100)), 0xA20E: pitch, 0xA210: (3, "H", (2,)), 0xA405: (3, "H", (99,))}
    # 2.54 mm at 10000 pixels an inch.
    assert read_focal_length(with_block(tmp_path / "a.jpg", entries, order)) == pytest.approx(1000)


def test_a_focal_length_that_cannot_be_is_passed_over(tmp_path):
    for film in (0, 2, 60000):
        assert read_focal_length(photo(tmp_path / "a.jpg", 360, 240, FocalLengthIn35mmFilm=film)) is None
    assert read_focal_length(photo(tmp_path / "a.jpg", 360, 240)) is None
    assert read_focal_length(photo(tmp_path / "a.png", 360, 240)) is None


def located(path, latitude=(12.0, 30.0, 36.0), longitude=(151.0, 15.0, 0.0), altitude=70.0, refs="SW", below=0):
    """A JPEG with a position and a time."""
    spec = oiio.ImageSpec(4, 3, 3, oiio.UINT8)
    for name, value, ref in (("Latitude", latitude, refs[0]), ("Longitude", longitude, refs[1])):
        spec.attribute(f"GPS:{name}", oiio.TypeDesc("float[3]"), value)
        spec[f"GPS:{name}Ref"] = ref
    if altitude is not None:
        spec["GPS:Altitude"], spec["GPS:AltitudeRef"] = altitude, below
    spec["Exif:DateTimeOriginal"] = "2024:05:17 08:09:10"
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(np.zeros((3, 4, 3), np.uint8))
    file.close()
    return path


def test_a_position_has_degrees_minutes_and_seconds_and_signs(tmp_path):
    path = tmp_path / "a.jpg"
    assert read_gps_position(located(path)) == pytest.approx((-12.51, -151.25, 70.0), abs=1e-6)
    assert read_gps_position(located(path, refs="NE", below=1)) == pytest.approx((12.51, 151.25, -70.0), abs=1e-6)
    for below, altitude in ((0, 70.0), (1, -70.0), (2, 70.0), (3, -70.0)):  # 2 and 3 are of EXIF 3.0
        assert read_gps_position(located(path, below=below))[2] == altitude
    for unknown in (None, 1e6):
        place = read_gps_position(located(path, altitude=unknown))
        assert place[:2] == pytest.approx((-12.51, -151.25), abs=1e-6) and np.isnan(place[2])
    for wrong in (
        {"latitude": (91.0, 0.0, 0.0)},
        {"longitude": (181.0, 0.0, 0.0)},
        {"latitude": (0.0, 0.0, 0.0), "longitude": (0.0, 0.0, 0.0), "refs": "NE"},
    ):
        assert read_gps_position(located(path, **wrong)) is None, wrong
    assert read_gps_position(photo(path, 4, 3)) is None


def test_a_time_is_read_where_there_is_one(tmp_path):
    assert read_capture_time(located(tmp_path / "a.jpg")) == "2024-05-17T08:09:10"
    assert read_capture_time(photo(tmp_path / "b.jpg", 4, 3, DateTimeOriginal="yesterday")) is None


@pytest.mark.parametrize(
    ("names", "pictures"),
    [
        (["a.jpg", "a.png", "a_png.jpg"], ["a_jpg.png", "a_png.png", "a_png_2.png"]),
        (["one/a.jpg", "two/a.jpg"], ["one_a_jpg.png", "two_a_jpg.png"]),
        (["a b.jpg", "a_b.jpg", "#1\t.jpg"], ["a_b_jpg.png", "a_b_jpg_2.png", "_1_.png"]),
        (["flight.2024.jpg"], ["flight.2024.png"]),
    ],
)
def test_every_photo_has_a_name_of_its_own_in_one_word(names, pictures):
    assert name_pictures(names) == pictures


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


def test_a_photo_held_upright_is_turned_to_the_shape_of_the_sensor(tmp_path):
    camera = synth.camera((0, 0, 1))
    photo = np.random.default_rng(0).random((synth.HEIGHT, synth.WIDTH, 3)).astype(np.float32)
    upright = np.ascontiguousarray(np.rot90(photo, -1))  # as EXIF's orientation 6 shows it
    assert np.array_equal(undistort_scene_photo(upright, tmp_path, camera), photo)
    assert np.array_equal(undistort_scene_photo(photo, tmp_path, camera), photo)
    with pytest.raises(InputError, match="uncropped$"):
        undistort_scene_photo(upright[:200], tmp_path, camera)
