"""True pictures of candidates, and the true error against them."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import Pose, pose_offset
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import scene
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.views import oracle
from dav_gswt.views.scoring import ground_mask, scoring_camera

SIDE = 48
GRID, FIELD = ground.grid(), ground.field()
ENTRY = {"family": "desert", "seed": 0, "agent": "render"}


def candidates(width, height, count=1):
    """Places around the middle, at 45 degrees."""
    found = [Pose(f"p{i}.png", 45.0, 360.0 * i / count, 5.0) for i in range(count)]
    return [(pose, cameras.pinhole(pose_offset(pose), [0, 0, 0], width, height, 50.0)) for pose in found]


def noise(camera):
    return np.random.default_rng(0).uniform(0, 1, (camera.height, camera.width, 3)).astype(np.float32)


@pytest.mark.parametrize(
    "size, drawn",
    [
        pytest.param((384, 288), (384, 288), id="as the photo is taken"),
        pytest.param((1024, 512), (384, 192), id="no larger than it need be"),
        pytest.param((64, 32), (96, 48), id="no smaller than it is scored"),
    ],
)
def test_what_can_be_rendered_is_drawn_as_a_photo_then_shrunk(monkeypatch, size, drawn):
    taken = []
    monkeypatch.setattr(scene, "render", lambda world, camera: taken.append(camera) or noise(camera))
    pool = candidates(*size, count=2)
    views = list(oracle.render_truth(ENTRY, pool, "nowhere"))
    assert [(camera.width, camera.height) for camera in taken] == [drawn] * 2
    assert [view.name for view in views] == ["p0.png", "p1.png"]
    for view, camera, (_, whole) in zip(views, taken, pool, strict=True):
        (w, h), k = (view.camera.width, view.camera.height), drawn[0] // 96
        assert (w, h) == (96, drawn[1] // k) and np.allclose(view.camera.centre, whole.centre)
        assert view.camera.fx / w == pytest.approx(whole.fx / size[0]) == pytest.approx(camera.fx / drawn[0])
        means = noise(camera).reshape(h, k, w, k, 3).mean((1, 3))
        np.testing.assert_allclose(view.image, means, atol=1e-6)
        assert (view.weight == 1).all()


@pytest.mark.parametrize("size", [(144, 192), (109, 67)])
def test_a_replayed_scene_truly_shows_its_frames_without_what_is_masked(tmp_path, size):
    ((pose, camera),) = pool = candidates(*size)
    cover = np.ones((camera.height, camera.width), np.float32)
    cover[: camera.height // 2] = 0
    image_files.write_png(tmp_path / pose.name, np.dstack([noise(camera), cover]))
    (view,) = oracle.render_truth({"agent": "replay"}, pool, tmp_path)
    small = scoring_camera(camera)
    assert vars(view.camera).keys() == vars(small).keys() and view.camera.fx == small.fx
    assert view.image.shape == (small.height, small.width, 3) == (*view.weight.shape, 3)
    assert max(view.image.shape) == 96
    shrunk = image_files.shrink_image(noise(camera), small.width, small.height)
    np.testing.assert_allclose(view.image, shrunk, atol=0.5 / 255)
    middle = small.height // 2
    assert (view.weight[: middle - 1] == 0).all() and (view.weight[middle + 1 :] == 1).all()


def test_truth_is_not_known_where_photos_must_be_asked_for(tmp_path):
    with pytest.raises(InputError, match="handheld"):
        list(oracle.render_truth({"agent": "handheld"}, candidates(64, 64), tmp_path))
    with pytest.raises(InputError, match=r"p0\.png"):
        list(oracle.render_truth({"agent": "replay"}, candidates(128, 96), tmp_path))


def test_few_candidates_are_spread():
    chosen = oracle.spread_candidates(candidates(8, 8, count=12), 2)
    assert [pose.name for pose, _ in chosen] == ["p0.png", "p6.png"]


@pytest.fixture(scope="module")
def views():
    """Pictures of the field that show ground beyond the exemplar too."""
    eyes = [[1.6, 1.7, 4.0], [0.9, 2.2, 3.5]]
    at = [cameras.pinhole(eye, [1.6, 1.6, 0], SIDE, SIDE, 60.0) for eye in eyes]
    pictures = [np.clip(render(FIELD, camera).colour, 0, 1) for camera in at]
    whole = np.ones((SIDE, SIDE), np.float32)
    return [TrainingView(f"photo_{i}", *both, whole) for i, both in enumerate(zip(at, pictures, strict=True))]


def test_rmse_is_the_root_mean_square_over_channels_and_the_pixels_that_count(views):
    view = views[0]
    counts = ground_mask(GRID, view.camera) > 0
    columns = np.arange(SIDE) < 20
    off = np.where(counts & columns, np.float32(0.3), np.where(counts, np.float32(0), np.float32(0.7)))
    wrong = replace(view, image=view.image + off[..., None] * np.float32([0, 1, 0]))
    (error,), (found,) = oracle.measure_errors(FIELD, GRID, [wrong], SIDE)
    np.testing.assert_allclose(found[counts & columns], 0.3 / 3**0.5, atol=1e-5)
    np.testing.assert_allclose(found[counts & ~columns], 0, atol=1e-5)
    np.testing.assert_array_equal(np.isnan(found), ~counts)
    assert 0 < counts.sum() < counts.size
    assert error == pytest.approx(0.3 / 3**0.5 * (counts & columns).sum() ** 0.5 / counts.sum() ** 0.5, abs=1e-5)
    hidden = replace(wrong, weight=(~columns * np.ones((SIDE, 1))).astype(np.float32))
    (error,), (found,) = oracle.measure_errors(FIELD, GRID, [hidden], SIDE)
    assert error == pytest.approx(0, abs=1e-5) and np.isnan(found[:, columns]).all()


def test_another_exposure_counts_unless_it_is_corrected_and_a_view_of_nothing_modelled_has_no_rmse(views):
    gain, offset = np.float32([0.8, 0.9, 0.7]), np.float32([0.1, 0.05, 0.0])
    other = [replace(view, image=gain * view.image + offset) for view in views]
    assert (oracle.measure_errors(FIELD, GRID, other, SIDE)[0] > 0.02).all()
    np.testing.assert_allclose(oracle.measure_errors(FIELD, GRID, other, SIDE, corrected=True)[0], 0, atol=1e-5)
    aside = replace(views[0], camera=cameras.pinhole([90, 90, 4], [90, 90.1, 0], SIDE, SIDE, 40.0))
    error, maps = oracle.measure_errors(FIELD, GRID, [aside, views[1]], SIDE)
    assert np.isnan(error[0]) and np.isnan(maps[0]).all() and np.isfinite(error[1])


def test_the_field_is_drawn_as_large_as_it_was_fitted(views):
    large = ground.grid(0.02)
    fine = ground.field(large)
    photo = np.clip(render(fine, views[0].camera.resized(4 * SIDE, 4 * SIDE)).colour, 0, 1).astype(np.float32)
    view = replace(views[0], image=image_files.shrink_image(photo, SIDE, SIDE))
    assert oracle.measure_errors(fine, large, [view], 4 * SIDE)[0][0] == pytest.approx(0, abs=1e-6)
    assert oracle.measure_errors(fine, large, [view], SIDE)[0][0] > 1e-3
