from dataclasses import replace

import numpy as np
import pytest
from fixtures.frames import scene_frame
from scipy.ndimage import gaussian_filter, map_coordinates, zoom

from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.fitting import exposure
from dav_gswt.reconstruction.fitting.photo_colours import median_colours

FRAME = scene_frame(exemplar=(0.0, 0.0, 4.0), extent=(0.0, 0.0, 4.0, 4.0))


@pytest.fixture
def grid():
    return ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=8, margin=0.0)


def photo(colour, name="photo", eye=(2.0, 2, 6)):
    camera = cameras.pinhole(eye, [eye[0], eye[1], 0], 40, 40, 60.0)
    image = np.broadcast_to(np.asarray(colour, np.float32), (40, 40, 3)).copy()
    return TrainingView(name, camera, image, np.ones((40, 40), np.float32))


def test_the_median_ignores_one_photo_that_differs(grid):
    three = [photo([0.2, 0.3, 0.4]), photo([0.2, 0.3, 0.4]), photo([0.9, 0.9, 0.9])]
    colours, known = median_colours(grid.centres, three)
    assert known.any()
    np.testing.assert_allclose(colours[known], np.tile([0.2, 0.3, 0.4], (known.sum(), 1)), atol=1e-6)
    assert np.isnan(colours[~known]).all()


def test_the_median_of_two_photos_is_their_mean(grid):
    colours, known = median_colours(grid.centres, [photo([0.2, 0.2, 0.2]), photo([0.4, 0.4, 0.4])])
    np.testing.assert_allclose(colours[known], 0.3, atol=1e-6)


def test_exposures_are_levelled_without_drift(grid):
    rng = np.random.default_rng(0)
    texture = rng.uniform(0.2, 0.7, (40, 40, 3)).astype(np.float32)
    gains = [0.8, 1.0, 1.0, 1.25]
    photos = [replace(photo([0, 0, 0], str(g)), image=(texture * g).astype(np.float32)) for g in gains]
    levelled = exposure.equalize_exposure(photos, grid.centres)
    for view in levelled:
        np.testing.assert_allclose(view.image.mean((0, 1)), texture.mean((0, 1)), rtol=0.02)


@pytest.mark.parametrize("away", [0.7, 2.0])
def test_grain_that_lies_beside_its_place_takes_no_contrast_from_the_photos(grid, away):
    """Six photos of fine grain and coarse patches, each some pixels off: poses and relief leave as much."""
    rng = np.random.default_rng(0)
    texture = np.repeat(rng.uniform(0.3, 0.6, (420, 420, 1)), 3, 2) + np.repeat(
        zoom(rng.uniform(-0.1, 0.1, (6, 6)), 70, order=1)[..., None], 3, 2
    )
    gains = [0.9, 1.0, 1.0, 1.0, 1.0, 1.1]
    photos = []
    for gain in gains:
        x, y = np.rint(10 + away * rng.normal(size=2)).astype(int)
        photos.append(large_photo((gain * texture[y : y + 400, x : x + 400]).astype(np.float32)))
    spread = [view.image.std() / view.image.mean() for view in photos]
    levelled = exposure.equalize_exposure(photos, grid.centres)
    for view, before in zip(levelled, spread, strict=True):
        assert view.image.std() / view.image.mean() == pytest.approx(before, rel=0.05)
        np.testing.assert_allclose(view.image.mean((0, 1)), texture.mean((0, 1)), rtol=0.02)


def test_photos_from_afar_and_at_a_slant_keep_their_contrast(grid):
    """Coarse pixels of theirs would hold more ground, so less of the texture's contrast."""
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(200, 200))
    waves = np.hypot(*np.meshgrid(np.fft.fftfreq(200), np.fft.fftfreq(200)))
    waves[0, 0] = 1
    pink = np.fft.ifft2(np.fft.fft2(noise) / waves).real
    texture = 0.45 + 0.1 * (pink - pink.mean()) / pink.std()
    near = [((x, y, 1.5), (x, y, 0)) for x in (1.0, 2, 3) for y in (1.0, 2, 3)]
    far = [((2.0, 2.2, z), (2, 2.2, 0)) for z in (4.0, 9)] + [((x, 2.0, 1.5), (2, 2, 0)) for x in (-2.0, 6)]
    photos = [look_at_texture(texture, eye, target) for eye, target in near + far]
    levelled = exposure.equalize_exposure(photos, grid.centres)
    for view, before in zip(levelled, photos, strict=True):
        assert view.image.std() / before.image.std() == pytest.approx(1, abs=0.06)


def look_at_texture(texture, eye, target):
    """A photo of a texture over the plane, 4 wide, each pixel the mean of what it covers; grey beyond."""
    camera = cameras.pinhole(eye, target, 96, 96, 60.0)
    origin, step = camera.rays()
    ground_at = (origin - origin[..., 2:] / step[..., 2:] * step)[..., :2] * 50
    footprint = float(np.linalg.norm(np.subtract(eye, target))) / camera.fx * 50
    x, y = np.clip(ground_at, 0, 199).transpose(2, 0, 1)
    image = map_coordinates(gaussian_filter(texture, 0.4 * footprint), [y, x], order=1)
    beyond = (np.abs(ground_at - 100) > 100).any(-1) | (step[..., 2] >= 0)
    image = np.repeat(np.where(beyond, 0.45, image)[..., None], 3, 2).astype(np.float32)
    return TrainingView("photo", camera, image, np.ones(image.shape[:2], np.float32))


def test_a_photo_of_another_level_keeps_its_colours_above_zero(grid):
    """A brighter photo of the same contrast, with something dark in it that no other photo shows."""
    rng = np.random.default_rng(4)
    texture = np.repeat(zoom(rng.uniform(0.05, 0.5, (10, 10, 1)), (40, 40, 1), order=0), 3, 2)
    photos = [large_photo(texture.astype(np.float32)) for _ in range(4)]
    bright = (0.25 + 0.88 * texture).astype(np.float32)
    bright[:80, :100] = 0.15
    for view in exposure.equalize_exposure([*photos, large_photo(bright)], grid.centres):
        assert view.image.min() > 0


def test_photos_that_see_no_ground_keep_their_exposure(grid):
    near = [photo(np.full(3, 0.4)), photo(np.full(3, 0.4)), photo(np.full(3, 0.6))]
    far = [photo([0.2, 0.2, 0.2], eye=(400.0, 400.0, 6.0)) for _ in range(5)]
    levelled = exposure.equalize_exposure(near + far, grid.centres)
    np.testing.assert_allclose([view.image.mean() for view in levelled], [0.4] * 3 + [0.2] * 5, atol=1e-3)
    assert exposure.equalize_exposure(far, grid.centres) == far


def large_photo(image):
    """A photo from above of as many pixels as the image."""
    camera = cameras.pinhole((2.0, 2, 6), [2, 2, 0], len(image), len(image), 60.0)
    return TrainingView("photo", camera, image, np.ones(image.shape[:2], np.float32))


def test_a_pictures_exposure_is_found_beside_what_moves():
    rng = np.random.default_rng(1)
    picture = rng.uniform(0.2, 0.8, (40, 40, 3)).astype(np.float32)
    image = (1.1 * picture - 0.03).astype(np.float32)
    image[:6] = 1.0  # something else
    none = np.ones(3, np.float32), np.zeros(3, np.float32)
    a, b = exposure.update_gain_and_offset(picture, exposure.sample_photo(image, np.ones((40, 40), np.float32)), none)
    # the prior's share: 1e-3 against the variance of the picture, 0.03
    np.testing.assert_allclose(a, 1.1, atol=0.01)
    np.testing.assert_allclose(b, -0.03, atol=0.01)


def test_pixels_without_weight_and_flat_pictures_give_no_gain():
    none = np.ones(3, np.float32), np.zeros(3, np.float32)
    picture = np.full((40, 40, 3), 0.4, np.float32)
    flat = photo([0.5, 0.5, 0.5])
    a, b = exposure.update_gain_and_offset(picture, exposure.sample_photo(flat.image, flat.weight), none)
    np.testing.assert_allclose(a, 1, atol=1e-6)
    np.testing.assert_allclose(b, 0.1, atol=1e-6)
    blind = exposure.sample_photo(flat.image, np.zeros((40, 40), np.float32))
    assert exposure.update_gain_and_offset(picture, blind, none) is none


def test_the_level_of_the_typical_photo_is_taken_out():
    rng = np.random.default_rng(2)
    picture = rng.uniform(0.2, 0.8, (40, 40, 3)).astype(np.float32)
    tracker = exposure.ExposureTracker(3)
    np.testing.assert_array_equal(tracker.gain_and_offset(2), (np.ones(3), np.zeros(3)))
    for _ in range(20):
        for index, gain in enumerate([0.9, 1.0, 1.1]):  # of a field that is too dark
            image = (gain * (picture / 0.95 + 0.02)).astype(np.float32)
            tracker.update(index, picture, replace(photo([0, 0, 0]), image=image))
    used = np.array([tracker.gain_and_offset(i) for i in range(3)])
    np.testing.assert_allclose(used[1], np.repeat([[1.0], [0.0]], 3, 1), atol=0.01)
    np.testing.assert_allclose(used[:, 0], np.repeat([[0.9], [1.0], [1.1]], 3, 1), atol=0.02)


@pytest.mark.parametrize("count", [4, 48, 200])
def test_colours_do_not_swing_however_many_photos_there_are(count):
    """A field that is brightened or darkened by .004 a step, as its photos ask for; they differ by 2 %.

    A median that follows the field as fast as the field follows it is late by half a turn of all photos: of 200 the
    brightness then swings by .5.
    """
    rng = np.random.default_rng(3)
    texture = rng.uniform(0.2, 0.8, (40, 40, 3)).astype(np.float32)
    tracker, bright, momentum, away = exposure.ExposureTracker(count), 0.0, 0.0, []
    for step in range(1200):
        if step % count == 0:
            turn = rng.permutation(count)
        picture, taken = texture + np.float32(bright), texture * np.float32(rng.normal(1, 0.02))
        index = int(turn[step % count])
        tracker.update(index, picture, replace(photo([0, 0, 0]), image=taken))
        a, b = tracker.gain_and_offset(index)
        momentum = 0.9 * momentum + 0.1 * float((picture * a + b - taken).mean())
        bright -= 0.004 * np.clip(momentum / 1e-3, -1, 1)
        away.append(abs(bright))
    assert max(away) < 0.08 and np.mean(away[-200:]) < 0.03
