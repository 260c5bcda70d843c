"""What cells of the scale study cost, on a small field."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.images import image_files
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings
from dav_gswt.study.scale import costs, photos

FRAME = replace(made.FRAME, kind="synthetic")
SETTINGS = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=6)


@pytest.fixture(scope="module")
def fitted():
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    return fit_coarse_field(StartViews(FRAME, made.photos(4), *none, 0.15), SETTINGS, np.random.default_rng(0))


def test_photos_show_the_field_from_as_many_sides_as_asked_for(fitted, tmp_path):
    photos.render_photos(fitted.field, FRAME, 3, 48, tmp_path)
    shown = [image_files.read_photo(path) for path in sorted(tmp_path.iterdir())]
    assert [picture.shape for picture in shown] == [(48, 48, 3)] * 3
    assert all(picture.std() > 0.02 for picture in shown) and not np.array_equal(shown[0], shown[1])


def test_a_fit_is_measured(fitted, tmp_path):
    photos.render_photos(fitted.field, FRAME, 10, 48, tmp_path / "photos")
    settings = replace(SETTINGS, steps_per_photo=2, spacing=0.75)
    found = costs.measure_fit(fitted.field, FRAME, tmp_path / "photos", 10, settings, tmp_path)
    assert found["steps"] == 6 + 2 * 2 and found["photos"] == 10 and found["gaussians"] > 1000
    assert found["seconds"] >= found["read_seconds"] + found["prepare_seconds"] > 0
    assert found["step_seconds"] > 0 and found["peak_mb"] > 10


def test_a_render_of_more_gaussians_than_the_field_has_is_measured(fitted):
    count = 3 * len(fitted.field)
    found = costs.measure_render(fitted.field, count)
    assert found["gaussians"] == count and found["seconds"] > 0


def test_scores_are_measured(fitted):
    found = costs.measure_scores(fitted.field, fitted.grid, FRAME, 3)
    assert found["candidates"] == 3 and found["seconds"] > 0


def test_a_view_of_about_as_many_tiles_as_asked_for_is_measured(fitted):
    found = costs.measure_view(fitted.field, 400)
    assert found["tiles"] == pytest.approx(400, rel=0.25) and found["seconds"] > 0
