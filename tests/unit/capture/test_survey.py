import json
import re
from itertools import pairwise

import numpy as np
import pytest

from dav_gswt.capture import survey
from dav_gswt.capture.survey import Lens
from dav_gswt.errors import InputError
from dav_gswt.geometry.georeference import Georeference

LENS = Lens()
WHERE = ["--latitude", "47.1", "--longitude", "8.2", "--altitude", "430", "--side", "20"]


def circles(views):
    """Cameras by height and how far the point they look at is from the middle."""
    found = {}
    for _, camera in views:
        at = camera.centre - camera.centre[2] / camera.forward[2] * camera.forward
        key = (round(camera.centre[2], 3), round(-camera.forward[2], 4), round(float(np.hypot(*at[:2])), 3))
        found.setdefault(key, []).append(camera)
    return found


def test_overlap_of_photos_straight_down_is_that_of_their_rectangles():
    lens = Lens(fov=60.0, aspect=4 / 3)
    a = lens.camera(90.0, 0.0, 10.0, 0.0)
    for away in (0.5, 2.0, 6.0):
        b = lens.camera(90.0, 0.0, 10.0, away)
        # azimuth 0: the picture's top is west, its shorter side runs east; rays sample it in 24 rows
        shorter = 2 * 10 * lens.half_tangent
        assert survey.overlap_share(a, b) == pytest.approx(1 - away / shorter, abs=1 / 24)


def test_neighbours_on_every_circle_overlap_enough():
    views = survey.plan_exhaustive(20.0, [12.0, 6.0], LENS)
    rings = circles(views)
    assert {key[0] for key in rings} == {12.0, 6.0}
    assert len({key[1] for key in rings}) == 3
    for ring in rings.values():
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
            if len(ring) > 1:
                assert min(survey.overlap_share(a, b), survey.overlap_share(b, a)) >= 0.7
                assert a.forward @ b.forward >= np.cos(np.radians(30.001))


def test_circles_of_one_height_overlap_with_the_next():
    rings = sorted(circles(survey.plan_exhaustive(20.0, [8.0], LENS)).items())
    down = [ring[0] for (_, steepness, _), ring in rings if steepness == 1]
    assert len(down) >= 3
    assert min(survey.overlap_share(a, b) for a, b in pairwise(down)) >= 0.7


def test_an_exhaustive_flight_shows_every_place_often_and_a_start_flight_all_of_it():
    assert survey.count_least_views(survey.plan_exhaustive(20.0, [8.0], LENS), 20.0) >= 8
    height = survey.covering_height(20.0, LENS)
    assert survey.count_least_views(survey.plan_start(8, [height], LENS), 20.0) >= 3
    above = survey.plan_start(8, [height], LENS)[0][1]
    assert height * (above.height / 2 / above.fy) >= 10.0  # half a side, on the ground


def test_a_start_flight_has_a_photo_from_straight_above_and_a_circle_at_each_height():
    views = survey.plan_start(12, [20.0, 12.0], LENS)
    assert len(views) == 12
    np.testing.assert_allclose(views[0][1].centre, [0, 0, 20], atol=1e-9)
    heights = [round(camera.centre[2], 6) for _, camera in views[1:]]
    assert (heights.count(20.0), heights.count(12.0)) == (5, 6)
    elevations = [np.degrees(np.arcsin(-camera.forward[2])) for _, camera in views[1:]]
    np.testing.assert_allclose(elevations, 65.0)


def test_the_plan_that_is_written_has_the_cameras_that_were_meant(tmp_path):
    out = tmp_path / "flight.plan"
    assert survey.main(["start", str(out), *WHERE, "--heights", "20", "--north", "25", "--minutes", "60"]) == 0
    views = survey.plan_start(8, [20.0], LENS)
    mission = json.loads(out.read_text())["mission"]
    items = mission["items"]
    stops = [i for i, item in enumerate(items) if item["command"] == 205]
    assert len(stops) == len(views)
    place = Georeference(47.1, 8.2, 430.0, 25.0, 1.0)
    at = [[*items[i - 1]["params"][4:6], items[i - 1]["params"][6] + mission["plannedHomePosition"][2]] for i in stops]
    found = place.to_world(np.array(at))
    meant = np.array([camera.centre for _, camera in views])
    gaps = np.linalg.norm(found[:, None] - meant[None], axis=-1).min(1)
    assert gaps.max() < 0.002  # metres: places are written to 0.1 mm, altitudes to 1 mm
    assert {round(items[i]["params"][0]) for i in stops} == {-90, -65}


def test_a_flight_longer_than_a_battery_becomes_several_files(tmp_path):
    views = survey.plan_exhaustive(20.0, [20.0], LENS)
    assert survey.main(["exhaustive", str(tmp_path / "all.plan"), *WHERE, "--heights", "20", "--minutes", "4"]) == 0
    written = sorted(tmp_path.iterdir())
    assert [path.name for path in written] == [f"all_{i + 1}.plan" for i in range(len(written))]
    assert len(written) > 1
    items = [json.loads(path.read_text())["mission"]["items"] for path in written]
    assert sum(item["command"] == 2000 for one in items for item in one) == len(views)
    assert all(one[0]["command"] == 22 and one[-1]["command"] == 20 for one in items)


def test_too_few_and_too_many_photos_are_refused(monkeypatch):
    with pytest.raises(InputError, match=r"take at least (\d+)") as said:
        survey.plan_start(4, [20.0], LENS)
    enough = int(str(said.value).split()[-1])
    assert len(survey.plan_start(enough, [20.0], LENS)) == enough
    with pytest.raises(InputError):
        survey.plan_start(enough - 1, [20.0], LENS)
    monkeypatch.setattr(survey, "MOST", 20)
    with pytest.raises(InputError, match="more than 20 photos"):
        survey.plan_exhaustive(20.0, [20.0], LENS)


def test_a_flight_too_small_for_gps_says_what_is_large_enough(tmp_path, capsys):
    out = str(tmp_path / "a.plan")
    assert survey.main(["start", out, *WHERE]) == 0
    times = float(re.search(r"--side ([0-9.]+) times as large", capsys.readouterr().out)[1])
    assert survey.main(["start", out, *WHERE[:-1], str(20 * times)]) == 0
    assert "GPS" not in capsys.readouterr().out


def test_what_cannot_be_flown_is_said(tmp_path, capsys):
    assert survey.main(["start", str(tmp_path / "a.plan"), *WHERE, "--heights", "5"]) == 1
    assert "fly at" in capsys.readouterr().err
    assert survey.main(["start", str(tmp_path / "a.plan"), *WHERE, "--min-altitude", "30"]) == 1
    assert "lower than 30 m" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        survey.main(["start", str(tmp_path / "a.plan"), *WHERE, "--latitude", "147"])
    assert not (tmp_path / "a.plan").exists()
