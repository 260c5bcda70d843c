import numpy as np
import pytest
from fixtures.frames import scene_frame
from scipy.ndimage import zoom

from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.fitting import exposure
from dav_gswt.reconstruction.photo_colours import median_colours

FRAME = scene_frame(exemplar=(0.0, 0.0, 4.0), extent=(0.0, 0.0, 4.0, 4.0))


@pytest.fixture
def grid():
    return ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=8, margin=0.0)


def photo(image, eye=(2.0, 2, 6)):
    """A photo from above, of an image or of one colour."""
    image = np.asarray(image, np.float32)
    image = image if image.ndim == 3 else np.broadcast_to(image, (40, 40, 3)).copy()
    camera = cameras.pinhole(eye, [eye[0], eye[1], 0], len(image), len(image), 60.0)
    return TrainingView("photo", camera, image, np.ones(image.shape[:2], np.float32))


def test_the_median_ignores_one_photo_that_differs_and_of_two_is_their_mean(grid):
    three = [photo([0.2, 0.3, 0.4]), photo([0.2, 0.3, 0.4]), photo([0.9, 0.9, 0.9])]
    colours, known = median_colours(grid.centres, three)
    assert known.any()
    np.testing.assert_allclose(colours[known], np.tile([0.2, 0.3, 0.4], (known.sum(), 1)), atol=1e-6)
    assert np.isnan(colours[~known]).all()
    colours, known = median_colours(grid.centres, three[1:])
    np.testing.assert_allclose(colours[known], np.tile([0.55, 0.6, 0.65], (known.sum(), 1)), atol=1e-6)


def test_grain_that_lies_beside_its_place_takes_no_contrast_from_the_photos(grid):
    """Six photos of fine grain and coarse patches, each some pixels off: poses and relief leave as much."""
    rng = np.random.default_rng(0)
    texture = np.repeat(rng.uniform(0.3, 0.6, (420, 420, 1)), 3, 2) + np.repeat(
        zoom(rng.uniform(-0.1, 0.1, (6, 6)), 70, order=1)[..., None], 3, 2
    )
    photos = []
    for gain in [0.9, 1.0, 1.0, 1.0, 1.0, 1.1]:
        x, y = np.rint(10 + 2 * rng.normal(size=2)).astype(int)
        photos.append(photo(gain * texture[y : y + 400, x : x + 400]))
    spread = [view.image.std() / view.image.mean() for view in photos]
    levelled = exposure.equalize_exposure(photos, grid.centres)
    for view, before in zip(levelled, spread, strict=True):
        assert view.image.std() / view.image.mean() == pytest.approx(before, rel=0.05)
        np.testing.assert_allclose(view.image.mean((0, 1)), texture.mean((0, 1)), rtol=0.02)
