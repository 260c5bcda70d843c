"""Features and matches in COLMAP's database: progress is counted without a look into it."""

import sys
from contextlib import closing

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.photos.sfm import features
from dav_gswt.photos.sfm.features import enter_camera, enter_image, extract_features, match_photos, split_batches

OPENERS = ("sqlite3.connect", "subprocess.Popen")


class Watch:
    """Notes what opens a database or starts a process while `active`; a hook can't be taken away again."""

    def __init__(self):
        self.active, self.seen = False, []
        sys.addaudithook(self)

    def __call__(self, event, arguments):
        if self.active and event in OPENERS:
            self.seen.append((event, arguments))


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """Six photos and a database that knows them."""
    folder = tmp_path_factory.mktemp("photos")
    cameras = synth.flight(2, 3, step=0.2)
    synth.shoot(folder, cameras, synth.texture(np.random.default_rng(4)), 1.0)
    with closing(pycolmap.Database.open(folder / "database.db")) as store:
        params = [synth.FOCAL, synth.WIDTH / 2, synth.HEIGHT / 2, 0.0]
        lens = pycolmap.Camera(model="SIMPLE_RADIAL", width=synth.WIDTH, height=synth.HEIGHT, params=params)
        numbers = enter_camera(store, lens)
        for i in range(len(cameras)):
            enter_image(store, f"{i:03d}.png", *numbers)
    return folder


def find_and_match(photos, tmp_path):
    """The database of features and matches, as rows by image and by pair."""
    database = tmp_path / "database.db"
    database.write_bytes((photos / "database.db").read_bytes())
    extract_features(photos, database, 320, 1024, 1)
    match_photos(6, database, 0, 1, 0)
    with closing(pycolmap.Database.open(database)) as store:
        found = [store.read_keypoints(i) for i in range(1, 7)]
        return found, [store.read_two_view_geometry(1, i).inlier_matches for i in range(2, 7)]


def test_nothing_else_opens_the_database_while_colmap_writes(photos, tmp_path, monkeypatch):
    """A second reader can lock it, and then COLMAP aborts the process."""
    monkeypatch.setattr(features, "LOOK", 0.001, raising=False)  # of versions that looked every few seconds
    watch = Watch()
    watch.active = True
    try:
        find_and_match(photos, tmp_path)
    finally:
        watch.active = False
    assert not watch.seen


def test_batches_change_nothing(photos, tmp_path, monkeypatch):
    (tmp_path / "few").mkdir()
    whole = find_and_match(photos, tmp_path)
    monkeypatch.setattr(features, "PHOTOS", 2)
    monkeypatch.setattr(features, "PAIRS", 4)
    few = find_and_match(photos, tmp_path / "few")
    for one, two in zip(sum(whole, []), sum(few, []), strict=True):
        assert np.array_equal(one, two)


def test_all_items_come_in_batches():
    assert list(split_batches(list("abcde"), 2, "letters")) == [["a", "b"], ["c", "d"], ["e"]]
