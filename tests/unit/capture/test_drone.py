import json
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.capture import drone, drop_folder, route
from dav_gswt.capture.store import PhotoStore, Site
from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.poses import pose_of_camera

PLACE = Georeference(47.1, 8.2, 430.0, 30.0, 20.0)  # a world unit is 20 m
FRAME = scene_frame(
    unit="flying height",
    flying_height=1.0,
    exemplar=(-0.5, -0.5, 1.0),
    georeference=Georeference(latitude=47.1, longitude=8.2, altitude=430.0, north=30.0, metres_per_unit=20.0),
)
DRONE = {"min_altitude": 2.0, "clearance": 5.0}
ORBITS = [(90, 0, 1.0), (60, 10, 1.0), (45, 200, 1.2), (30, 100, 0.8), (10, 45, 1.0), (9, 46, 1.0)]


@pytest.fixture
def requested():
    found = [camera_layouts.orbit(*orbit, [0, 0, 0], 64, 48, 60.0) for orbit in ORBITS]
    return [(pose_of_camera(f"pose_{i}", camera, FRAME), camera) for i, camera in enumerate(found)]


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.setattr(drop_folder, "import_dropped_photos", lambda site, requested, agent: requested)
    return Site("moor", {"agent": "plan", "drone": DRONE}, FRAME, tmp_path, PhotoStore(tmp_path / "captures" / "moor"))


@pytest.fixture
def items(site, requested):
    with pytest.raises(InputError):
        drone.take_photos(site, requested)
    return json.loads((site.store.folder / "mission.plan").read_text())["mission"]["items"]


def places(items):
    """World positions of everything with a place, the vehicle's home in front, and their items."""
    found = [item for item in items if item["frame"] == 3]
    earth = [[*item["params"][4:6], item["params"][6] + 430.0] for item in found]
    home = [*items[0]["params"][4:6], 430.0]
    return PLACE.to_world(np.array([home, *earth])), found


def test_the_items_are_numbered_and_their_altitudes_are_above_home(site, items):
    plan = json.loads((site.store.folder / "mission.plan").read_text())
    mission = plan["mission"]
    assert (plan["fileType"], plan["version"], mission["version"], mission["cruiseSpeed"]) == ("Plan", 1, 2, 3)
    assert mission["plannedHomePosition"] == [*items[0]["params"][4:6], 430.0]
    assert [item["doJumpId"] for item in items] == list(range(1, len(items) + 1))
    assert all(len(item["params"]) == 7 and item["type"] == "SimpleItem" and item["autoContinue"] for item in items)
    assert all(item["Altitude"] == item["params"][6] for item in items if item["frame"] == 3)
    assert [items[0]["command"], items[1]["command"], items[-1]["command"]] == [22, 178, 20]


def test_photos_are_taken_from_the_poses_with_their_views(items, requested):
    stops = [i for i, item in enumerate(items) if item["command"] == 16 and items[i + 1]["command"] == 205]
    assert len(stops) == len(requested)
    left = {pose.name: camera for pose, camera in requested}
    for i in stops:
        assert [item["command"] for item in items[i + 1 : i + 5]] == [205, 93, 2000, 93]
        hold, _, _, yaw, latitude, longitude, up = items[i]["params"]
        at = PLACE.to_world(np.array([[latitude, longitude, 430.0 + up]]))[0]
        name = min(left, key=lambda n: np.linalg.norm(left[n].centre - at))
        camera = left.pop(name)
        # places are written to 0.1 mm and 1 mm; altitudes above the ellipsoid differ from the plane's by 0.1 mm here
        np.testing.assert_allclose(at, camera.centre, atol=0.002 / 20)
        pitch, roll, turned = items[i + 1]["params"][:3]
        assert (hold > 0, roll, turned, items[i + 1]["params"][6]) == (True, 0, 0, 2)
        # the world's +y is 30 degrees east of north: east and north of the view, by hand
        a, e = np.radians(yaw - 30), np.radians(pitch)
        ahead = [np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)]
        np.testing.assert_allclose(ahead, camera.forward, atol=2e-5)  # angles are written to a thousandth of a degree
        assert items[i + 3]["params"][:3] == [0, 0, 1]
    assert not left


def test_sideways_ways_stay_above_the_clearance(items):
    at, _ = places(items)
    at = at * 20
    assert at[:, 2].min() < 5  # two poses and the start lie below it
    for a, b in zip(at[:-1], at[1:], strict=True):
        if np.linalg.norm(a[:2] - b[:2]) > 0.01:
            assert min(a[2], b[2]) >= 5 - 0.002


def test_the_message_says_what_to_fly_what_is_missing_and_where_to_put_it(site, requested, monkeypatch):
    with pytest.raises(InputError) as said:
        drone.take_photos(site, requested[:2])
    for part in ("mission.plan", "photos of 2 poses are missing (pose_0, pose_1)", "drop", "same command again"):
        assert part in str(said.value)
    # (0, -10, 5), (0, 0, 20), (9.85, 1.74, 17.32) and back: 18.03 + 10.35 + 19.66 m; at each stop 4 s and a photo
    assert "48 m, about 1 min, up to 20 m above the ground" in str(said.value)
    (site.store.folder / "mission.plan").unlink()
    monkeypatch.setattr(drop_folder, "import_dropped_photos", lambda site, requested, agent: [])
    assert drone.take_photos(site, requested) is None
    assert not (site.store.folder / "mission.plan").exists()


def test_a_scene_without_gps_is_refused(site, requested):
    bare = Site("moor", site.scene, replace(FRAME, georeference=None), site.photos, site.store)
    with pytest.raises(InputError, match="GPS positions in their EXIF"):
        drone.take_photos(bare, requested)


def said_on_a_slope(site, requested, slope, **flight):
    frame = replace(FRAME, georeference=replace(FRAME.georeference, slope=slope))
    with pytest.raises(InputError) as raised:
        drone.take_photos(Site("moor", {"drone": DRONE | flight}, frame, site.photos, site.store), requested)
    return str(raised.value)


def test_ground_too_steep_for_altitudes_above_a_plane_is_refused(site, requested):
    # the farthest of the high poses is 0.8 x 20 m from where the drone takes off: 10 degrees are 2.9 m
    high = requested[:3]
    message = said_on_a_slope(site, high, 10.0)
    assert "slopes by 10.0 degrees" in message and "up to 2.9 m; set scenes.moor.drone.clearance" in message
    assert "fly this mission" in said_on_a_slope(site, high, 10.0, clearance=12)
    assert "fly this mission" in said_on_a_slope(site, requested, 2.0)
    # pose_4 and pose_5 are planned at 3.5 and 3.1 m, 27 m from where the drone takes off: 4.8 m off
    assert "min_altitude to 10 or more" in said_on_a_slope(site, requested, 10.0, clearance=12)


def way(places, ordered, start=None, end=None):
    stops = [p for p in (start, *places[list(ordered)], end) if p is not None]
    return route.path_length(np.array(stops))


@pytest.mark.parametrize("start, end", [(None, None), (0.0, None), (0.0, 0.0), (0.0, 1.0)])
def test_every_place_is_visited_once_and_no_stretch_can_be_turned_round_to_shorten_the_way(start, end):
    for seed in range(20):
        places = np.random.default_rng(seed).random((9, 2))
        first, last = (None if at is None else np.full(2, at) for at in (start, end))
        ordered = route.order_stops(places, first, last)
        assert sorted(ordered) == list(range(9))
        long = way(places, ordered, first, last)
        for i, j in combinations(range(10), 2):
            turned = [*ordered[:i], *ordered[i:j][::-1], *ordered[j:]]
            assert way(places, turned, first, last) >= long - 1e-9
