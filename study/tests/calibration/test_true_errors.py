"""The true error of a field at candidates."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground

from dav_gswt.geometry import cameras
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.views.scoring import ground_mask
from dav_gswt_study.calibration.judging import measure_errors

SIDE = 48
GRID, FIELD = ground.grid(), ground.field()


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
    (error,) = measure_errors(FIELD, GRID, [wrong], SIDE)
    assert 0 < counts.sum() < counts.size
    assert error == pytest.approx(0.3 / 3**0.5 * (counts & columns).sum() ** 0.5 / counts.sum() ** 0.5, abs=1e-5)
    hidden = replace(wrong, weight=(~columns * np.ones((SIDE, 1))).astype(np.float32))
    assert measure_errors(FIELD, GRID, [hidden], SIDE) == pytest.approx([0], abs=1e-5)


def test_another_exposure_counts_unless_it_is_corrected_and_a_view_of_nothing_modelled_has_no_rmse(views):
    gain, offset = np.float32([0.8, 0.9, 0.7]), np.float32([0.1, 0.05, 0.0])
    other = [replace(view, image=gain * view.image + offset) for view in views]
    assert (measure_errors(FIELD, GRID, other, SIDE) > 0.02).all()
    np.testing.assert_allclose(measure_errors(FIELD, GRID, other, SIDE, corrected=True), 0, atol=1e-5)
    aside = replace(views[0], camera=cameras.pinhole([90, 90, 4], [90, 90.1, 0], SIDE, SIDE, 40.0))
    assert np.isnan(measure_errors(FIELD, GRID, [aside, views[1]], SIDE)).tolist() == [True, False]


def test_the_field_is_drawn_as_large_as_it_was_fitted(views):
    large = ground.grid(0.02)
    fine = ground.field(large)
    photo = np.clip(render(fine, views[0].camera.resized(4 * SIDE, 4 * SIDE)).colour, 0, 1).astype(np.float32)
    view = replace(views[0], image=image_files.shrink_image(photo, SIDE, SIDE))
    assert measure_errors(fine, large, [view], 4 * SIDE)[0] == pytest.approx(0, abs=1e-6)
    assert measure_errors(fine, large, [view], SIDE)[0] > 1e-3
