"""Synthetic scenes: pictures are taken where cameras say and repeat, and what the photos/ folder holds."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.geometry.cameras import pinhole
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.photos.colmap_model import ColmapModel, read_colmap_model
from dav_gswt.photos.synthetic import mitsuba_scene, photo_set
from dav_gswt.photos.synthetic import scene as synthetic

mi = pytest.importorskip("mitsuba")


@pytest.fixture(autouse=True)
def small(small_land):
    """Land that is quick to make."""


def off_centre(width=96, height=64):
    """A camera that looks askance and whose principal point is far from the middle."""
    camera = pinhole((3.0, -4.0, 5.0), (0.3, 0.2, 0.0), width, height, 50.0)
    return replace(camera, cx=0.37 * width, cy=0.71 * height)


def test_points_of_light_appear_where_the_camera_projects_them():
    camera = off_centre()
    points = np.array([[1.2, 0.4, 0.3], [-0.6, -0.9, 0.8], [-0.9, 0.9, 0.1]])
    expected, depth = camera.project(points)
    sensor = mi.load_dict(mitsuba_scene.make_sensor(camera, {"type": "multijitter", "sample_count": 256}))
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    for point, pixel, z in zip(points, expected, depth, strict=True):
        assert 5 < pixel[0] < camera.width - 5 and 5 < pixel[1] < camera.height - 5
        ball = {"type": "sphere", "center": point.tolist(), "radius": float(2.0 * z / camera.fx)}
        world = mi.load_dict({"type": "scene", "ball": ball | {"light": {"type": "area"}}})
        light = np.array(mi.render(world, sensor=sensor, integrator=mi.load_dict({"type": "direct"}), spp=256))[..., 0]
        found = [(light * columns).sum() / light.sum(), (light * rows).sum() / light.sum()]
        # a ball of 2 pixels off the axis is seen as an ellipse whose middle is off by 2^2/f * tan < 0.03 pixels;
        # 256 rays a pixel leave 0.02 more
        assert found == pytest.approx(pixel, abs=0.06)


def test_a_picture_repeats_to_the_byte_whatever_the_threads():
    import drjit

    scene, camera = synthetic.Scene("desert", 0), off_centre(50, 38)
    before = drjit.thread_count()
    try:
        drjit.set_thread_count(1)
        one = synthetic.render(scene, camera, 4)
        drjit.set_thread_count(3)
        synthetic.load_scene.cache_clear()
        three = synthetic.render(scene, camera, 4)
    finally:
        drjit.set_thread_count(before)
    assert one.dtype == np.float32 and one.shape == (38, 50, 3)
    assert one.tobytes() == three.tobytes()
    assert one.min() >= 0 and one.max() <= 1 and one.std() > 0.02


ENTRY = {"family": "desert", "seed": 0, "photo_count": 3, "test": 2, "size": 64, "candidates": 0}


def test_views_yield_points_on_the_ground(tmp_path, monkeypatch):
    """Photos of flat ground from a height of 6 metres."""
    monkeypatch.setattr(photo_set, "FEATURES", 300)
    cameras = synth.flight(2, 3, step=0.9, height=6.0)
    synth.shoot(tmp_path, cameras, synth.texture(np.random.default_rng(4)), 6.0)
    shots = [(f"{i:03d}.png", camera) for i, camera in enumerate(cameras)]
    every = photo_set.triangulate_points(tmp_path, shots, 0)
    assert every.names == tuple(name for name, _ in shots)
    assert len(every.points) > 100 and np.quantile(np.abs(every.points[:, 2]), 0.9) < 0.05
    more = photo_set.add_cameras(every, [("-test.png", cameras[0])])
    assert more.names == ("-test.png", *every.names) and more.cameras[0] == cameras[0]
    assert np.array_equal(np.array(more.names)[more.image_of], np.array(every.names)[every.image_of])


@pytest.fixture
def dark(monkeypatch):
    """Black photos, in which no point is found: only the record is looked at here."""

    def nothing(folder, shots, seed):
        names, cameras = (tuple(column) for column in zip(*shots, strict=True))
        none = np.zeros(0, int)
        return ColmapModel(names, cameras, np.zeros((0, 3)), np.zeros((0, 3), np.float32), none, none, np.zeros((0, 2)))

    monkeypatch.setattr(synthetic, "render", lambda scene, camera: np.zeros((64, 64, 3), np.float32))
    monkeypatch.setattr(photo_set, "triangulate_points", nothing)


def test_test_views_are_x(dark, tmp_path):
    entry = ENTRY | {"min_elevation": 60}
    around = synthetic.orbit_cameras([(45.0, 20.0 + turn, 6.3) for turn in (0, 120, 240)], 64)
    cameras = {"high": synthetic.test_views(entry), "oblique": around}
    groups = {"high": ["test_00.png", "test_01.png"], "oblique": ["test_02.png", "test_03.png", "test_04.png"]}
    photo_set.render_set(entry, tmp_path, synthetic.start_views(entry), cameras)
    frame = read_scene_frame(tmp_path / "ground.json")
    assert frame.test_groups == {group: tuple(names) for group, names in groups.items()}
    assert frame.test == tuple(name for group in groups.values() for name in group)
    assert frame.images == frame.registered == 3
    stored = read_colmap_model(tmp_path / "sparse")
    for name, camera in zip(frame.test, [*cameras["high"], *around], strict=True):
        assert stored.camera(name).centre == pytest.approx(camera.centre)
    pictures = sorted(p.name for p in (tmp_path / "images").iterdir())
    assert pictures == [*frame.test, "view_00.png", "view_01.png", "view_02.png"]
