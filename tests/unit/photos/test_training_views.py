"""Training views in memory and in files."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.photos import training_views
from dav_gswt.photos.array_file import ArrayFile
from dav_gswt.photos.training_views import one_by_one, open_array_file
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings

FRAME = replace(made.FRAME, kind="photos")  # with exposures and moving things


@pytest.fixture
def filed(tmp_path):
    """Photos that lie in files."""
    arrays = ArrayFile(tmp_path)
    views = [replace(view, arrays=arrays) for view in made.photos(5)]
    return [view.with_pixels(image=view.image, weight=view.weight) for view in views]


def test_pixels_of_a_view_in_files_lie_in_files(filed):
    changed = filed[0].with_pixels(weight=filed[0].weight * 0.5)
    assert not changed.weight.flags.writeable and changed.weight.max() == 0.5
    assert changed.image is filed[0].image


def test_pixels_of_a_view_in_memory_stay_there():
    view, weight = made.photos(1)[0], np.zeros((48, 48), np.float32)
    assert view.with_pixels(weight=weight).weight is weight


def test_views_one_by_one_are_the_views(filed):
    assert list(one_by_one(filed)) == filed


def test_views_one_by_one_are_released_after_each_turn(filed, monkeypatch):
    released = []
    monkeypatch.setattr(training_views, "release_pages", released.append)
    turns = one_by_one(filed)
    next(turns)
    assert released == []
    next(turns)
    assert [array is filed[0].image for array in released] == [True, False]


def test_few_photos_lie_in_memory_and_many_in_files(tmp_path):
    camera = made.photos(1)[0].camera.resized(4000, 3000)
    assert open_array_file([camera] * 40, 768, tmp_path) is None
    assert open_array_file([camera] * 80, 768, tmp_path) is not None
    assert open_array_file([camera] * 40, 2000, tmp_path) is not None


def test_a_fit_is_the_same_from_files_to_the_bit(filed):
    settings = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=24)
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    fields = [
        fit_coarse_field(StartViews(FRAME, views, *none, 0.15), settings, np.random.default_rng(0)).field
        for views in (made.photos(5), filed)
    ]
    for name, array in vars(fields[0]).items():
        assert np.array_equal(array, getattr(fields[1], name)), name
