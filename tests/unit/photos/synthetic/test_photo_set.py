"""Points of synthetic scenes: which pairs of views are matched, and that points lie on the ground."""

import numpy as np
import pytest

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import look_at
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import desert, photo_set
from dav_gswt.photos.synthetic import scene as synthetic

ENTRY = {"family": "desert", "seed": 0, "photos": 100, "test": 0, "size": 64, "candidates": 0, "layout": "paper"}


def angle(one, other):
    """Degrees between two cameras as seen from the origin."""
    a, b = (c.centre / np.linalg.norm(c.centre) for c in (one, other))
    return np.degrees(np.arccos(np.clip(a @ b, -1, 1)))


def test_of_many_views_each_is_matched_with_some_that_see_the_same_ground_alike():
    cameras = synthetic.start_views(ENTRY)
    pairs = photo_set.find_overlapping_pairs(cameras)
    assert all(0 <= i < j < 100 for i, j in pairs) and len(set(pairs)) == len(pairs)
    assert 100 * photo_set.NEIGHBOURS / 2 <= len(pairs) <= 100 * photo_set.NEIGHBOURS  # of 4950
    assert max(angle(cameras[i], cameras[j]) for i, j in pairs) <= 60
    partners = [{i + j - k for i, j in pairs if k in (i, j)} for k in range(100)]
    assert min(map(len, partners)) >= photo_set.NEIGHBOURS
    reached = {0}
    while more := set().union(*(partners[k] for k in reached)) - reached:
        reached |= more
    assert reached == set(range(100))
    # points need some angle: half of each view's partners are more than 10 degrees away
    assert min(np.median([angle(cameras[k], cameras[j]) for j in partners[k]]) for k in range(100)) > 10


def test_views_of_other_ground_or_from_opposite_sides_are_no_pair():
    here = [camera_layouts.orbit(60, azimuth, 7.0, (0, 0, 0), 64, 64, 55.0) for azimuth in (0, 20)]
    opposite = camera_layouts.orbit(20, 190, 7.0, (0, 0, 0), 64, 64, 55.0)
    away = camera_layouts.orbit(60, 0, 7.0, (30.0, 0, 0), 64, 64, 55.0)
    assert photo_set.find_overlapping_pairs([*here, opposite, away]) == [(0, 1)]
    assert look_at(away.centre, (30.0, 0, 0))[0] == pytest.approx(away.rotation)


def test_few_and_many_views_yield_points_on_the_ground(tmp_path, monkeypatch):
    pytest.importorskip("mitsuba")
    monkeypatch.setattr(desert, "TEXELS", 1024)
    scene = synthetic.make_scene("desert", 0)
    cameras = synthetic.start_views(ENTRY | {"photos": 7, "size": 256, "layout": "ring"})
    shots = [(f"view_{i:02d}.png", camera) for i, camera in enumerate(cameras)]
    for name, camera in shots:
        image_files.write_png(tmp_path / name, synthetic.render(scene, camera, 9))
    synthetic._load_scene.cache_clear()
    every = photo_set.triangulate_points(tmp_path, shots, 0)
    monkeypatch.setattr(photo_set, "EXHAUSTIVE", 4)
    monkeypatch.setattr(photo_set, "NEIGHBOURS", 3)
    some = photo_set.triangulate_points(tmp_path, shots, 0)
    for found in (every, some):
        assert found.names == tuple(name for name, _ in shots)
        assert len(found.points) > 100
        # undulation of 0.1 m and stones of 0.3; few points are wrong matches
        assert np.quantile(np.abs(found.points[:, 2]), 0.9) < 0.4
    assert len(some.pixels) < len(every.pixels)
