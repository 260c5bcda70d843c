"""Photo sets of synthetic scenes: the pairs of views, points on the ground, and what the photos/ folder holds."""

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.scene_frame import Extent, read_scene_frame
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.photos.synthetic import photo_set
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic.labels import GroundLabels, read_label_map

ENTRY = {"family": "desert", "seed": 0, "photos": 3, "test": 2, "size": 64, "candidates": 0}


def angle(one, other):
    """Degrees between two cameras as seen from the origin."""
    a, b = (c.centre / np.linalg.norm(c.centre) for c in (one, other))
    return np.degrees(np.arccos(np.clip(a @ b, -1, 1)))


def test_of_many_views_each_is_matched_with_some_that_see_the_same_ground_alike():
    cameras = synthetic.start_views(ENTRY | {"photos": 100, "layout": "paper"})
    pairs = photo_set.find_overlapping_pairs(cameras)
    assert all(0 <= i < j < 100 for i, j in pairs) and len(set(pairs)) == len(pairs)
    assert 100 * photo_set.NEIGHBOURS / 2 <= len(pairs) <= 100 * photo_set.NEIGHBOURS  # of 4950
    assert max(angle(cameras[i], cameras[j]) for i, j in pairs) <= 60
    partners = [{i + j - k for i, j in pairs if k in (i, j)} for k in range(100)]
    assert min(map(len, partners)) >= photo_set.NEIGHBOURS
    # points need some angle: half of each view's partners are more than 10 degrees away
    assert min(np.median([angle(cameras[k], cameras[j]) for j in partners[k]]) for k in range(100)) > 10


def test_views_of_other_ground_or_from_opposite_sides_are_no_pair():
    here = [camera_layouts.orbit(60, azimuth, 7.0, (0, 0, 0), 64, 64, 55.0) for azimuth in (0, 20)]
    opposite = camera_layouts.orbit(20, 190, 7.0, (0, 0, 0), 64, 64, 55.0)
    away = camera_layouts.orbit(60, 0, 7.0, (30.0, 0, 0), 64, 64, 55.0)
    assert photo_set.find_overlapping_pairs([*here, opposite, away]) == [(0, 1)]


def test_few_and_many_views_yield_points_on_the_ground(tmp_path, monkeypatch):
    """Photos of flat ground from a height of 6 metres."""
    monkeypatch.setattr(photo_set, "FEATURES", 300)
    cameras = synth.flight(2, 3, step=0.9, height=6.0)
    synth.shoot(tmp_path, cameras, synth.texture(np.random.default_rng(4)), 6.0)
    shots = [(f"{i:03d}.png", camera) for i, camera in enumerate(cameras)]
    every = photo_set.triangulate_points(tmp_path, shots, 0)
    monkeypatch.setattr(photo_set, "EXHAUSTIVE", 4)
    monkeypatch.setattr(photo_set, "NEIGHBOURS", 1)
    some = photo_set.triangulate_points(tmp_path, shots, 0)
    for found in (every, some):
        assert found.names == tuple(name for name, _ in shots)
        assert len(found.points) > 100 and np.quantile(np.abs(found.points[:, 2]), 0.9) < 0.05
    assert len(some.pixels) < len(every.pixels)
    more = photo_set.add_cameras(every, [("000_test.png", cameras[0]), ("zero.png", cameras[1])])
    assert more.names == ("000.png", "000_test.png", *every.names[1:], "zero.png")
    assert more.cameras[1] == cameras[0] and more.cameras[2] == every.cameras[1]
    assert np.array_equal(np.array(more.names)[more.image_of], np.array(every.names)[every.image_of])
    assert np.array_equal(more.pixels, every.pixels) and np.array_equal(more.point_of, every.point_of)


@pytest.fixture
def dark(monkeypatch):
    """Black photos, in which no point is found: only the record is looked at here."""

    def nothing(folder, shots, seed):
        names, cameras = (tuple(column) for column in zip(*shots, strict=True))
        none = np.zeros(0, int)
        return ColmapModel(names, cameras, np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2)))

    known = GroundLabels({"sand": 1}, np.ones((4, 4), int), 16.0, ())
    monkeypatch.setattr(synthetic, "render", lambda scene, camera: np.zeros((64, 64, 3), np.float32))
    monkeypatch.setattr(synthetic, "load_scene", lambda scene: synthetic.LoadedScene(None, known))
    monkeypatch.setattr(photo_set, "triangulate_points", nothing)


def test_test_views_are_written_by_group_and_the_labels_of_the_ground(dark, tmp_path):
    entry = ENTRY | {"layout": "cap", "min_elevation": 60, "oblique": 3}
    groups = {"high": ["test_00.png", "test_01.png"], "oblique": ["test_02.png", "test_03.png", "test_04.png"]}
    photo_set.render_set(entry, tmp_path)
    frame = read_scene_frame(tmp_path / "ground.json")
    assert frame.test_groups == {group: tuple(names) for group, names in groups.items()}
    assert frame.test == tuple(name for group in groups.values() for name in group)
    assert frame.images == frame.registered == 3
    stored = read_colmap_model(tmp_path / "sparse")
    tests = [camera for cameras in synthetic.test_views(entry).values() for camera in cameras]
    for name, camera in zip(frame.test, tests, strict=True):
        assert stored.camera(name).centre == pytest.approx(camera.centre)
    pictures = sorted(p.name for p in (tmp_path / "images").iterdir())
    assert pictures == [*frame.test, "view_00.png", "view_01.png", "view_02.png"]
    found = read_label_map(tmp_path / "truth")
    assert (found.material == 1).all() and found.extent == Extent(-3.0, -3.0, 3.0, 3.0)
