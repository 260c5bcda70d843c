"""`dav-gswt gaps`: exit codes, what it says, and the files it writes."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.cli import gaps, main
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.images import image_files
from dav_gswt.photos.gaps import find_gaps

PLACE = Georeference(52.0, 13.0, 40.0, north=30.0, metres_per_unit=1.0)
FRAME = scene_frame(kind="photos", unit="metre", flying_height=20.0, georeference=PLACE)


def placed(hole, frame=FRAME):
    """81 photos straight down from 20 m, without those in the middle if there is a hole."""
    at = [(5.0 * (i - 4), 5.0 * (j - 4)) for i in range(9) for j in range(9)]
    cameras = [synth.camera((x, y, 20.0)) for x, y in at if not hole or max(abs(x), abs(y)) > 11]
    points = synth.plain(1500, 28.0, np.random.default_rng(0)) + [0, 0, 2.0]
    left_out = (("lost.jpg", "it matches no photo"),)
    return gaps.PlacedPhotos(synth.model(cameras, points), frame, left_out, ("soft.jpg",))


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the command over three pictures, whose places are given."""
    photos = tmp_path / "photos"
    photos.mkdir()
    for i in range(3):
        image_files.write_png(photos / f"{i}.png", np.full((8, 8, 3), 0.5))

    def call(found):
        monkeypatch.setattr(gaps, "place_photos", lambda *_: found)
        return main.main(["gaps", str(photos), "-o", str(tmp_path / "out")])

    return call


def test_a_hole_gives_a_map_outlines_and_a_mission_that_goes_when_it_is_filled(run, tmp_path, capsys):
    assert run(placed(True)) == 1
    said = capsys.readouterr().out
    assert "56 of 57 photos could be placed" in said
    assert "lost.jpg could not be placed: it matches no photo" in said and "soft.jpg is blurred" in said
    assert "is missing" in said and "seen by no photo" in said and ", at 51.99999" in said
    (feature,) = json.loads((tmp_path / "out/gaps.geojson").read_text())["features"]
    assert np.allclose(np.mean(feature["geometry"]["coordinates"][0], 0), [13, 52], atol=1e-4)
    assert image_files.read_size(tmp_path / "out/gaps.png")[0] == 960
    assert (tmp_path / "out/mission.plan").is_file()
    assert run(placed(False)) == 0
    assert "No gaps: three photos or more" in capsys.readouterr().out
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["gaps.geojson", "gaps.png"]


def test_the_mission_takes_off_from_the_ground_below_a_photo_and_flies_at_the_usual_height(tmp_path):
    """The ground lies at z = 2: photos at 22 are 20 m above the place of take-off, and ways stay 10 m above all."""
    found = placed(True)
    gaps.plan_mission(tmp_path / "mission.plan", found, find_gaps(found.model, FRAME))
    mission = json.loads((tmp_path / "mission.plan").read_text())["mission"]
    shots = [item["command"] for item in mission["items"]].count(2000)
    heights = [item["Altitude"] for item in mission["items"] if "Altitude" in item]
    assert shots >= 3 and heights.count(20.0) == shots and min(heights) >= 10.0
    home = PLACE.to_world(np.array([mission["plannedHomePosition"]]))[0, :2]
    places = np.array([camera.centre[:2] for camera in found.model.cameras])
    assert np.linalg.norm(places - home, axis=1).min() < 0.01


def test_no_mission_is_written_without_gps_or_over_a_slope(tmp_path):
    for place, said in ((None, "no GPS"), (replace(PLACE, slope=40.0), "slopes by 40 degrees")):
        found = placed(True, replace(FRAME, georeference=place))
        assert said in gaps.plan_mission(tmp_path / "mission.plan", found, find_gaps(found.model, found.frame))
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_used_ends_with_1_and_a_wrong_call_with_2(tmp_path, capsys):
    splat = tmp_path / "a.spz"
    splat.write_bytes(b"\x1f\x8b" + bytes(64))
    assert main.main(["gaps", str(splat)]) == 1
    assert "name their folder" in capsys.readouterr().err
    assert main.main(["gaps", str(tmp_path / "none")]) == 1
    with pytest.raises(SystemExit) as stopped:
        main.main(["gaps"])
    assert stopped.value.code == 2
