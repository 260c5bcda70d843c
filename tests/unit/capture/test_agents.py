"""Agents that answer at once, the store that devices and people fill, and photos that are dropped into a folder."""

import json
import os
from types import SimpleNamespace

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt import capture
from dav_gswt.capture import drop_folder, render, replay, shots
from dav_gswt.capture.site import Site
from dav_gswt.capture.store import Store, key
from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files
from dav_gswt.photos import training_views
from dav_gswt.photos.sfm import localization

WHEN = "2026-05-04T10:00:00"


def at(x, y=0.0, z=5.0):
    return cameras.pinhole([x, y, z], [x, y, 0], 8, 8, 40.0)


def asked(*places):
    return [(Pose(f"a{i}", 90.0, 0.0, 5.0), at(x)) for i, x in enumerate(places)]


def picture(path, value=0.5):
    image_files.write_png(path, np.full((8, 8, 3), value, np.float32))
    return path


@pytest.fixture
def site(tmp_path):
    (tmp_path / "photos").mkdir()
    frame = scene_frame(flying_height=5.0)
    return Site("dune", {"agent": "handheld"}, frame, tmp_path / "photos", Store(tmp_path / "captures"))


def pool(tmp_path):
    (tmp_path / "images").mkdir()
    frames = {f"{x}.png": at(x) for x in (0, 1, 2)}
    for name in frames:
        (tmp_path / "images" / name).write_text(name)
    (tmp_path / "capture").mkdir()
    return frames


def test_replay_takes_the_nearest_unseen_frame_once_and_says_how_far_it_was(tmp_path):
    found = replay.take(tmp_path, pool(tmp_path), asked(0.9, 0.9, 0.9, 0.9), 1, tmp_path / "capture", unit=5.0)
    assert [shot.name for shot in found] == ["1.png", "0.png", "2.png"]
    np.testing.assert_allclose([shot.apart for shot in found], [0.1 / 5, 0.9 / 5, 1.1 / 5], atol=1e-6)
    shots.write(tmp_path / "capture", "replay", found)
    record = json.loads((tmp_path / "capture" / "capture.json").read_text())
    assert [s["name"] for s in record["shots"]] == ["1.png", "0.png", "2.png"] and record["agent"] == "replay"
    assert (tmp_path / "capture" / "1.png").read_text() == "1.png"


def test_a_burst_takes_several_photos_of_a_pose(tmp_path):
    found = replay.take(tmp_path, pool(tmp_path), asked(0.9, 0.9), 2, tmp_path / "capture", unit=5.0)
    assert [(shot.name, shot.pose.name) for shot in found] == [("1.png", "a0"), ("0.png", "a0"), ("2.png", "a1")]
    made = render.take(lambda _, i: np.full((8, 8, 3), i / 4, np.float32), asked(0.0), 3, tmp_path)
    assert [shot.name for shot in made] == ["a0_0.png", "a0_1.png", "a0_2.png"]
    assert image_files.read_photo(tmp_path / "a0_2.png")[0, 0, 0] == pytest.approx(0.5, abs=0.01)


def test_the_store_gives_a_poses_photos_back_and_no_others(tmp_path):
    store, (one, two) = Store(tmp_path / "captures"), asked(0.0, 1.0)
    assert store.of(one[1]) == []
    for value in (0.2, 0.4):
        store.add(picture(tmp_path / "in.PNG", value), "serial", *one, at(0.1), WHEN)
    found = store.of(one[1])
    assert [round(float(image_files.read_photo(s.photo)[0, 0, 0]), 1) for s in found] == [0.2, 0.4]
    assert found[0].got.centre[0] == pytest.approx(0.1) and found[0].taken == WHEN
    assert store.of(two[1]) == [] and len(store.records()) == 2


def test_a_photo_that_cannot_be_kept_whole_is_not_kept(tmp_path):
    store, (one,) = Store(tmp_path / "captures"), asked(0.0)
    with pytest.raises(OSError):
        store.add(tmp_path / "gone.png", "serial", *one, one[1], WHEN)
    assert store.of(one[1]) == [] and not list((tmp_path / "captures").glob(".part-*"))


def test_a_stored_photo_that_was_changed_is_refused_by_name(tmp_path):
    store, (one,) = Store(tmp_path / "captures"), asked(0.0)
    kept = store.add(picture(tmp_path / "in.png"), "serial", *one, one[1], WHEN)
    picture(kept.photo, 0.9)
    with pytest.raises(InputError, match=r"photo\.png.*put it back"):
        store.of(one[1])


def test_poses_are_told_apart_but_not_by_rounding():
    assert key(at(0.0)) == key(at(1e-9)) and key(at(0.0)) != key(at(1e-3)) and len(key(at(0.0))) == 24


def test_one_run_at_a_time_holds_the_device(tmp_path):
    with Store(tmp_path).locked(), pytest.raises(InputError, match="another run"), Store(tmp_path).locked():
        pass
    with Store(tmp_path).locked():
        pass


def device(monkeypatch, take):
    monkeypatch.setattr(capture, "import_module", lambda name: SimpleNamespace(take=take))


def test_what_the_store_holds_is_not_taken_again(site, tmp_path, monkeypatch):
    calls = []

    def take(site, missing):
        calls.append([pose.name for pose, _ in missing])
        for pose, camera in missing:
            site.store.add(picture(tmp_path / "in.png"), "handheld", pose, camera, at(0.25), WHEN)

    device(monkeypatch, take)
    both = asked(0.0, 1.0)
    site.store.add(picture(tmp_path / "in.png"), "handheld", *both[0], both[0][1], WHEN)
    for _ in range(2):
        found = capture._by_device(site, both, tmp_path)
    assert calls == [["a1"]]
    assert [shot.name for shot in found] == ["a0.png", "a1.png"]
    assert found[1].apart == pytest.approx(0.75 / 5) and found[1].taken == WHEN
    assert image_files.read_size(tmp_path / "a1.png") == (8, 8)


@pytest.mark.parametrize("agent", ["render", "replay", "serial", "plan", "handheld"])
def test_where_no_pose_was_chosen_nobody_is_asked_for_anything(agent, tmp_path, monkeypatch):
    def no_one(*_):
        raise AssertionError("somebody was asked for photos")

    device(monkeypatch, no_one)
    monkeypatch.setattr(render, "take", no_one)
    monkeypatch.setattr(replay, "take", no_one)
    monkeypatch.setattr(capture.candidates, "left", lambda *_: asked(0.0))
    scene = {"agent": agent, "kind": "photos"}
    site = Site("dune", scene, scene_frame(flying_height=5.0), tmp_path / "photos", Store(tmp_path / "captures"))
    capture.capture(site, {}, [], [], tmp_path / "capture")
    assert [path.name for path in (tmp_path / "capture").iterdir()] == ["capture.json"]
    assert json.loads((tmp_path / "capture/capture.json").read_text()) == {"agent": agent, "shots": []}
    assert training_views.captured(tmp_path / "capture", 8) == [] and not (tmp_path / "captures").exists()


def test_what_was_taken_before_a_failure_stays(site, tmp_path, monkeypatch):
    def take(site, missing):
        site.store.add(picture(tmp_path / "in.png"), "handheld", *missing[0], missing[0][1], WHEN)
        raise InputError("the battery is empty")

    device(monkeypatch, take)
    with pytest.raises(InputError, match="battery"):
        capture._by_device(site, asked(0.0, 1.0), tmp_path)
    assert len(site.store.of(at(0.0))) == 1 and not site.store.of(at(1.0))


def drop(site, places, monkeypatch):
    """Put photos into the drop folder, and say where each was taken."""
    folder = drop_folder.folder_of(site)
    for i, name in enumerate(places):
        os.utime(picture(folder / name, 0.1 * i), (0, 0))
    at_places = {name: value if value is None else at(value) for name, value in places.items()}
    monkeypatch.setattr(localization, "located", lambda photos, paths: [at_places[p.name] for p in paths])


def test_dropped_photos_go_to_the_poses_that_they_were_taken_for(site, monkeypatch, caplog):
    drop(site, {"x.png": 1.1, "y.png": 0.05, "lost.png": None, "far.png": 9.0}, monkeypatch)
    both = asked(0.0, 1.0, 4.0)
    missing = drop_folder.collect(site, both, "handheld")
    assert [pose.name for pose, _ in missing] == ["a2"]
    assert site.store.of(at(0.0))[0].got.centre[0] == pytest.approx(0.05)
    assert [r["source"] for r in site.store.records()] and site.store.of(at(1.0))[0].taken.startswith("1970-01-01")
    assert "lost.png: its place" in caplog.text and "far.png: no pose" in caplog.text
    assert (drop_folder.folder_of(site) / "x.png").exists()  # people's own files stay


def test_a_photo_is_taken_over_once(site, monkeypatch):
    drop(site, {"x.png": 0.1, "y.png": 0.2}, monkeypatch)
    for _ in range(2):
        assert drop_folder.collect(site, asked(0.0), "handheld") == []
    assert len(site.store.records()) == 1


def test_an_empty_drop_folder_leaves_all_poses_missing(site):
    assert len(drop_folder.collect(site, asked(0.0, 1.0), "plan")) == 2
