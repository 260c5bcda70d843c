import numpy as np
import pytest

from dav_gswt.images import metrics

ONE = np.ones((16, 16), np.float32)


def test_psnr_of_a_uniform_error_of_a_tenth_is_20_db():
    a = np.full((16, 16, 3), 0.5, np.float32)
    assert metrics.psnr(a, a + np.float32(0.1), ONE) == pytest.approx(20, abs=1e-4)  # float32's 0.1


def test_psnr_of_equal_pictures_has_no_value():
    a = np.full((16, 16, 3), 0.5, np.float32)
    assert metrics.psnr(a, a, ONE) is None


def test_pixels_of_weight_0_do_not_count():
    a = np.full((16, 16, 3), 0.5, np.float32)
    b = a + np.float32(0.1)
    b[:8] = 1
    weight = ONE.copy()
    weight[:8] = 0
    assert metrics.psnr(a, b, weight) == pytest.approx(20, abs=1e-4)
    with pytest.raises(ValueError, match="weight is 0"):
        metrics.psnr(a, b, 0 * ONE)


def test_colour_correction_undoes_a_change_of_exposure():
    rng = np.random.default_rng(0)
    picture = rng.uniform(0.2, 0.6, (16, 16, 3)).astype(np.float32)
    photo = picture * [1.2, 1.0, 0.8] + [0.05, 0, -0.02]
    np.testing.assert_allclose(metrics.correct_colours(picture, photo, ONE), photo, atol=1e-6)


def test_ssim_is_1_for_equal_pictures_and_falls_with_noise():
    rng = np.random.default_rng(0)
    a = rng.uniform(0, 1, (32, 32, 3)).astype(np.float32)
    weight = np.ones((32, 32), np.float32)
    assert metrics.ssim(a, a, weight) == pytest.approx(1, abs=1e-5)
    assert metrics.ssim(a, rng.uniform(0, 1, a.shape).astype(np.float32), weight) < 0.3
