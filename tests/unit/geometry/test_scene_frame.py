"""ground.json: what is written is read back, and what is wrong in it is named."""

import json
from dataclasses import replace

import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.scene_frame import (
    FocalLength,
    LeftOutPhoto,
    read_scene_frame,
    write_scene_frame,
)
from dav_gswt.geometry.sun import CapturedSun

PLACE = Georeference(47.1, 8.0, 430.0, 12.0, 2.5, slope=3.0)
FRAME = scene_frame(
    (1.0, -2.0, 4.0),
    (-5.0, -6.0, 7.0, 8.0),
    relief=0.01,
    georeference=PLACE,
    images=3,
    registered=2,
    left_out=(LeftOutPhoto("a.jpg", "too dark"),),
    focal_ratio=1.0,
    focal=FocalLength(300.0, 300.0, None, 3.0, "EXIF's"),
    reprojection_error=0.5,
    points=100,
    sun=CapturedSun(33.0, 270.0, "2024-06-23T20:00:00Z", "gps", 0.0, 0.1),
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "ground.json"


@pytest.mark.parametrize(
    "frame",
    [
        FRAME,
        replace(FRAME, georeference=None, focal=None, test=("b.png",)),
        scene_frame(kind="synthetic", test=("t.png",), test_groups={"low": ("t.png",)}, renderer={"llvm": None}),
        scene_frame(kind="field", relief=0.1, gaussians=9, removed=1),
    ],
    ids=["photos", "without GPS", "synthetic", "field"],
)
def test_what_is_written_is_read_back(path, frame):
    write_scene_frame(path, frame)
    assert read_scene_frame(path) == frame
    assert ("georeference" in path.read_text()) == (frame.georeference is not None)


def written_with(path, **values):
    """FRAME's ground.json with other values; None: without the key."""
    write_scene_frame(path, FRAME)
    changed = json.loads(path.read_text()) | values
    path.write_text(json.dumps({key: value for key, value in changed.items() if value is not None}))
    return path


def test_a_slope_that_is_not_stored_is_0_and_no_place_on_earth_is_refused(path):
    place = {"latitude": 47.1, "longitude": 8, "altitude": 430, "north": 12, "metres_per_unit": 2.5}
    assert read_scene_frame(written_with(path, georeference=place)).georeference == replace(PLACE, slope=0.0)
    for wrong in ({"metres_per_unit": 0}, {"latitude": 90}):
        with pytest.raises(InputError, match="no place on earth"):
            read_scene_frame(written_with(path, georeference=place | wrong))


@pytest.mark.parametrize(
    "values, said",
    [
        ({"exemplar": {"west": 0, "south": 0, "side": -1}}, "no square"),
        ({"exemplar": {"west": 0, "south": 0, "side": "nan"}}, "exemplar.side"),
        ({"kind": "film"}, "kind"),
        ({"georeference": {"latitude": 47.1, "longitude": 8, "altitude": 430, "metres_per_unit": 2.5}}, "north"),
    ],
)
def test_a_wrong_value_is_named(path, values, said):
    with pytest.raises(InputError, match=f"ground.json: not as the workflow writes it.*{said}.*photos stage again"):
        read_scene_frame(written_with(path, **values))
