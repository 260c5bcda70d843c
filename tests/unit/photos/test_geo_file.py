"""Positions by a geo.txt of OpenDroneMap."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.photos.geo_file import read_geo_files
from dav_gswt.photos.sfm import gps


@pytest.mark.parametrize(
    ("first", "x", "y"),
    [
        ("EPSG:4326", 9.0, 0.0),
        ("WGS84 UTM 32N", 500_000, 0),
        ("+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs", 500_000, 0),
    ],
)
def test_a_geo_txt_beside_the_photos_is_read(tmp_path, first, x, y):
    (tmp_path / "geo.txt").write_text(f"{first}\na.jpg {x} {y} 520.5 0 0 0 2 2\n\nb.jpg {x} {y}\nother.jpg {x} {y} 1\n")
    a, b = tmp_path / "a.jpg", tmp_path / "b.jpg"
    found = read_geo_files([a, b, tmp_path / "c.jpg"])
    assert list(found) == [a, b] and found[a] == pytest.approx((0.0, 9.0, 520.5), abs=1e-6)  # the middle of zone 32
    assert np.isnan(found[b][2])


def test_a_geo_txt_may_lie_beside_the_folder_images_and_counts_before_exif(tmp_path, monkeypatch):
    photos = [tmp_path / "images" / f"{i}.jpg" for i in range(4)]
    photos[0].parent.mkdir()
    rows = [f"{i}.jpg 9.0 {0.001 * i} 520" for i in range(4)]
    (tmp_path / "geo.txt").write_text("\n".join(["EPSG:4326", *rows]))
    monkeypatch.setattr(gps, "read_gps_position", lambda path: (1.0, 2.0, 3.0))
    found = gps.read_gps_positions(photos)
    assert (found.about.longitude, found.about.altitude) == (9.0, 520.0)
    assert found.at[:, 1] == pytest.approx(110.6 * np.array([-1.5, -0.5, 0.5, 1.5]), rel=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("+proj=utm +zone=32 +nadgrids=/etc/passwd\n", "line 1: .* no projection that is read"),
        ("EPSG:999999\n", "line 1: .* no projection"),
        ("", "line 1"),
        ("EPSG:4326\na.jpg 11.0\n", "line 2: is not `photo.jpg x y altitude`"),
        ("EPSG:4326\n\na.jpg east 48\n", "line 3"),
        ("EPSG:4326\na.jpg 649226 5318378\n", "line 2: no place on earth by 'EPSG:4326'"),
    ],
)
def test_a_geo_txt_that_is_none_is_named_with_its_line(tmp_path, text, message):
    (tmp_path / "geo.txt").write_text(text)
    with pytest.raises(InputError, match=f"geo.txt: {message}"):
        read_geo_files([tmp_path / "a.jpg"])
