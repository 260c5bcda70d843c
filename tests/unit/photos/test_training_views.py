"""Training views: their pixels, in memory and in files."""

import os
from dataclasses import replace

import numpy as np
import psutil
import pytest
from fixtures import ground as made

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import ArrayFile, read_training_view, release_pages
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings

FRAME = replace(made.FRAME, kind="photos")  # with exposures and moving things


@pytest.fixture
def filed(tmp_path):
    """Photos that lie in files."""
    arrays = ArrayFile(tmp_path)
    views = [replace(view, arrays=arrays) for view in made.photos(5)]
    return [view.with_pixels(image=view.image, weight=view.weight) for view in views]


def test_a_photo_is_shrunk_with_its_camera_and_mask_and_never_enlarged(tmp_path):
    """A picture of four columns, of which the alpha masks the last."""
    camera = replace(made.photos(1)[0].camera, fx=4.0, fy=4.0, cx=2.0, cy=1.0, width=4, height=2)
    pixels = np.repeat(np.array([0.0, 0.2, 0.4, 0.6])[None, :, None], 2, axis=0) * np.ones(3)
    image_files.write_png(tmp_path / "a.png", np.dstack([pixels, np.repeat([[1.0, 1, 1, 0]], 2, axis=0)]))
    whole = read_training_view("a.png", camera, tmp_path / "a.png", 99)
    assert whole.image == pytest.approx(pixels, abs=0.5 / 255) and whole.weight.tolist() == [[1, 1, 1, 0]] * 2
    half = read_training_view("a.png", camera, tmp_path / "a.png", 2, ArrayFile(tmp_path))
    assert half.image.shape == (1, 2, 3) and half.weight.tolist() == [[1, 0]] and not half.image.flags.writeable
    assert (half.camera.fx, half.camera.cx, half.camera.width, half.camera.height) == (2.0, 1.0, 2, 1)
    with pytest.raises(InputError, match="a.png: 4 x 2 pixels, its camera takes 5 x 2"):
        read_training_view("a.png", replace(camera, width=5), tmp_path / "a.png", 99)


def test_a_fit_is_the_same_from_files_to_the_bit(filed):
    settings = FitSettings(fit_size=48, spacing=1.0, max_gaussians=2000, steps=6)
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    fields = [
        fit_coarse_field(StartViews(FRAME, views, *none, 0.15), settings, np.random.default_rng(0)).field
        for views in (made.photos(5), filed)
    ]
    for name, array in vars(fields[0]).items():
        assert np.array_equal(array, getattr(fields[1], name)), name


@pytest.fixture
def arrays(tmp_path):
    return ArrayFile(tmp_path / "made")


def test_released_pages_take_no_memory_and_read_as_before(arrays):
    stored = [arrays.store(np.full(1_000_000, i, np.float64)) for i in range(20)]
    process = psutil.Process(os.getpid())
    assert [array.sum() for array in stored] == [i * 1e6 for i in range(20)]
    full = process.memory_info().rss
    for array in stored:
        release_pages(array[10:20])  # by any view of it
    assert full - process.memory_info().rss > 100e6
    assert [array[-1] for array in stored] == list(range(20))
    array = np.arange(5.0)
    release_pages(array[1:])
    assert array.sum() == 10
