"""The capture agents, the photo store, the drop folder, and which candidates remain for an agent."""

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch
from fixtures.frames import scene_frame
from fixtures.photo_store import read_records

from dav_gswt.capture import capturing, drop_folder
from dav_gswt.capture.agents import AGENTS
from dav_gswt.capture.capturing import filter_attainable
from dav_gswt.capture.store import PhotoStore, Site
from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import read_capture_record, write_capture_record
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction.ground import Ground

WHEN = "2026-05-04T10:00:00"


def at(x, y=0.0, z=5.0):
    return cameras.pinhole([x, y, z], [x, y, 0], 8, 8, 40.0)


def requested(*places):
    return [(Pose(f"a{i}", 90.0, 0.0, 5.0), at(x)) for i, x in enumerate(places)]


def picture(path, value=0.5):
    image_files.write_png(path, np.full((8, 8, 3), value, np.float32))
    return path


@pytest.fixture
def site(tmp_path):
    (tmp_path / "photos").mkdir()
    frame = scene_frame(flying_height=5.0)
    return Site("dune", {"agent": "handheld"}, frame, tmp_path / "photos", PhotoStore(tmp_path / "captures"))


def capture(site, agent, poses, pool=(), **scene):
    """The photos that an agent takes of poses, in a capture folder beside the photos."""
    folder = site.photos.parent / "capture"
    folder.mkdir(exist_ok=True)
    site = replace(site, scene=site.scene | {"agent": agent} | scene)
    return capturing.take_requested(site, poses, list(pool), folder)


def photo_pool(site):
    (site.photos / "images").mkdir(exist_ok=True)
    pool = [(Pose(f"{x}.png", 90.0, 0.0, 5.0), at(x)) for x in (0, 1, 2)]
    for pose, _ in pool:
        (site.photos / "images" / pose.name).write_text(pose.name)
    return pool


def test_replay_takes_the_nearest_unused_photo_once_and_records_the_distance(site, tmp_path):
    photos = capture(site, "replay", requested(0.9, 0.9, 0.9, 0.9), photo_pool(site))
    assert [photo.name for photo in photos] == ["1.png", "0.png", "2.png"]
    np.testing.assert_allclose([photo.distance for photo in photos], [0.1 / 5, 0.9 / 5, 1.1 / 5], atol=1e-6)
    assert (tmp_path / "capture" / "1.png").read_text() == "1.png"
    write_capture_record(tmp_path, "replay", photos)
    back = read_capture_record(tmp_path)[0]
    assert (back.name, back.pose, back.distance, back.taken) == ("1.png", photos[0].pose, photos[0].distance, None)
    np.testing.assert_array_equal(back.camera.centre, photos[0].camera.centre)


def test_the_store_gives_a_poses_photos_back_and_no_others(tmp_path):
    store, (one, two) = PhotoStore(tmp_path / "captures"), requested(0.0, 1.0)
    assert store.photos_of(one[1]) == []
    for value in (0.2, 0.4):
        store.add(picture(tmp_path / "in.PNG", value), "serial", one, at(0.1), WHEN)
    found = store.photos_of(one[1])
    assert [round(float(image_files.read_photo(s.photo)[0, 0, 0]), 1) for s in found] == [0.2, 0.4]
    assert found[0].camera.centre[0] == pytest.approx(0.1) and found[0].taken == WHEN
    assert store.photos_of(two[1]) == [] and len(read_records(store)) == 2


def test_a_photo_that_cannot_be_kept_whole_is_not_kept(tmp_path):
    store, (one,) = PhotoStore(tmp_path / "captures"), requested(0.0)
    with pytest.raises(OSError):
        store.add(tmp_path / "gone.png", "serial", one, one[1], WHEN)
    assert store.photos_of(one[1]) == [] and not list((tmp_path / "captures").glob(".part-*"))


def test_a_stored_photo_or_record_that_was_changed_is_refused_by_name(tmp_path):
    store, (one,) = PhotoStore(tmp_path / "captures"), requested(0.0)
    kept = store.add(picture(tmp_path / "in.png"), "serial", one, one[1], WHEN)
    picture(kept.photo, 0.9)
    with pytest.raises(InputError, match=r"photo\.png.*put it back"):
        store.photos_of(one[1])
    kept.photo.with_name("shot.json").write_text('{"photo": "photo.png"}')
    with pytest.raises(InputError, match=r"shot\.json: not the record of a photo"):
        store.list_digests([one[1]])


def test_one_run_at_a_time_holds_the_device(tmp_path):
    with PhotoStore(tmp_path).locked(), pytest.raises(InputError, match="another run"), PhotoStore(tmp_path).locked():
        pass
    with PhotoStore(tmp_path).locked():
        pass


def test_what_the_store_holds_is_not_taken_again(site, tmp_path, monkeypatch):
    calls = []

    def take(site, missing):
        calls.append([pose.name for pose, _ in missing])
        for pose in missing:
            site.store.add(picture(tmp_path / "in.png"), "handheld", pose, at(0.25), WHEN)

    monkeypatch.setitem(AGENTS, "handheld", replace(AGENTS["handheld"], take=take))
    both = requested(0.0, 1.0)
    site.store.add(picture(tmp_path / "in.png"), "handheld", both[0], both[0][1], WHEN)
    for _ in range(2):
        found = capture(site, "handheld", both)
    assert calls == [["a1"]]
    assert [photo.name for photo in found] == ["a0.png", "a1.png"]
    assert found[1].distance == pytest.approx(0.75 / 5) and found[1].taken == WHEN
    assert image_files.read_size(tmp_path / "capture/a1.png") == (8, 8)


def test_where_no_pose_was_chosen_no_agent_is_called(tmp_path, monkeypatch):
    refuse = replace(AGENTS["plan"], take=lambda *_: pytest.fail("somebody was asked for photos"))
    monkeypatch.setitem(AGENTS, "plan", refuse)
    monkeypatch.setattr(capturing.pools, "list_remaining", lambda *_: requested(0.0))
    scene = {"agent": "plan", "kind": "photos"}
    site = Site("dune", scene, scene_frame(flying_height=5.0), tmp_path / "photos", PhotoStore(tmp_path / "captures"))
    capturing.capture_views(site, ViewSplit((), (), ()), [], [], tmp_path / "capture")
    assert json.loads((tmp_path / "capture/capture.json").read_text()) == {"agent": "plan", "shots": []}
    assert read_capture_record(tmp_path / "capture") == [] and not (tmp_path / "captures").exists()


def drop(site, places, monkeypatch):
    """Put photos into the drop folder, and say where each was taken."""
    folder = drop_folder.make_drop_folder(site)
    for i, name in enumerate(places):
        os.utime(picture(folder / name, 0.1 * i), (0, 0))
    at_places = {name: value if value is None else at(value) for name, value in places.items()}
    monkeypatch.setattr(drop_folder, "localize_photos", lambda photos, paths: [at_places[p.name] for p in paths])


def test_dropped_photos_go_to_the_poses_that_they_were_taken_for(site, monkeypatch, caplog):
    drop(site, {"x.png": 1.1, "y.png": 0.05, "lost.png": None, "far.png": 9.0}, monkeypatch)
    both = requested(0.0, 1.0, 4.0)
    missing = drop_folder.import_dropped_photos(site, both, "handheld")
    assert [pose.name for pose, _ in missing] == ["a2"]
    assert site.store.photos_of(at(0.0))[0].camera.centre[0] == pytest.approx(0.05)
    assert site.store.photos_of(at(1.0))[0].taken.startswith("1970-01-01")
    assert "lost.png: it could not be localised" in caplog.text
    assert "far.png: it is near no requested pose" in caplog.text
    assert (drop_folder.make_drop_folder(site) / "x.png").exists()  # people's own files stay


def test_a_photo_is_taken_over_once_also_where_it_was_dropped_twice(site, monkeypatch, caplog):
    drop(site, {"x.png": 0.1, "y.png": 0.1}, monkeypatch)
    folder = drop_folder.make_drop_folder(site)
    shutil.copyfile(folder / "x.png", folder / "y.png")
    for _ in range(2):
        assert len(drop_folder.import_dropped_photos(site, requested(0.0, 0.2), "plan")) == 1
    assert [record["source"] for record in read_records(site.store)] == ["x.png"]
    assert "y.png: the same photo as x.png" in caplog.text


def test_a_photo_stored_for_a_pose_no_longer_asked_for_is_placed_again(site, monkeypatch):
    drop(site, {"x.png": 0.1}, monkeypatch)
    assert drop_folder.import_dropped_photos(site, requested(0.0), "plan") == []
    used = replace(site, requested=(at(0.0),))
    assert len(drop_folder.import_dropped_photos(used, requested(0.2), "plan")) == 1  # an earlier round has it
    assert drop_folder.import_dropped_photos(site, requested(0.2), "plan") == []
    assert len(read_records(site.store)) == 2


FRAME = scene_frame(exemplar=(-1.0, -1.0, 2.0), flying_height=2.0)
GRID = Ground(-3.0, -3.0, 6 / 48, 16, 16, 16, np.zeros((48, 48)), np.ones((48, 48), bool))
EMPTY = patch.field()[:0]
POOL = [
    (Pose("above", 90.0, 0.0, 2.5), cameras.pinhole([0, 0.01, 2.5], [0, 0, 0], 64, 64, 100.0)),
    (Pose("below", -90.0, 0.0, 0.2), cameras.pinhole([0, 0.01, -0.2], [0, 0, 0], 64, 64, 100.0)),
]


def names(scene):
    return [pose.name for pose, _ in filter_attainable(scene, FRAME, GRID, EMPTY, POOL)]


def test_infeasible_poses_are_left_out_but_of_a_replayed_scene():
    assert names({"agent": "replay"}) == ["above", "below"]
    assert names({"agent": "handheld"}) == ["above"]
    # the clearance is a share of the flying height
    near = [*POOL, (Pose("near", 90.0, 0.0, 0.09), cameras.pinhole([0.5, 0.01, 0.09], [0, 0, 0], 64, 64, 100.0))]
    found = filter_attainable({"agent": "render"}, FRAME, GRID, EMPTY, near)
    assert [pose.name for pose, _ in found] == ["above"]


def test_a_drone_is_sent_no_lower_than_it_may_fly():
    place = replace(FRAME, georeference=Georeference(48.0, 11.0, 500.0, 0.0, metres_per_unit=4.0))
    low = (Pose("low", 90.0, 0.0, 0.4), cameras.pinhole([0, 0.01, 0.4], [0, 0, 0], 64, 64, 100.0))

    def kept(frame, altitude):
        scene = {"agent": "plan", "drone": {"min_altitude": altitude}}
        return [pose.name for pose, _ in filter_attainable(scene, frame, GRID, EMPTY, [*POOL, low])]

    assert kept(FRAME, 2.0) == ["above", "low"] == kept(place, 1.5)
    assert kept(place, 2.0) == ["above"]
    with pytest.raises(InputError, match="all 3 candidate poses are lower than 12 m"):
        kept(place, 12.0)
