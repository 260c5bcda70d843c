"""Arithmetic on images of few channels: the same bits as NumPy's broadcasting; PSNR and SSIM."""

import numpy as np
import pytest

from dav_gswt.images import channels, metrics


@pytest.fixture
def image():
    return np.random.default_rng(0).normal(size=(5, 7, 3)).astype(np.float32)


@pytest.fixture
def alpha():
    return np.random.default_rng(1).uniform(size=(5, 7)).astype(np.float32)


@pytest.mark.parametrize("shape", [(3,), (5, 7, 3)])
def test_sums_with_a_colour_or_another_image_are_those_of_broadcasting(image, alpha, shape):
    other = np.random.default_rng(2).uniform(size=shape).astype(np.float32)
    before, found = image.copy(), channels.composite(image, alpha, other)
    assert found.dtype == np.float32 and np.array_equal(found, before + (1 - alpha)[..., None] * other)
    assert channels.sum_products(image, other) == pytest.approx((before.astype(float) * other).sum(-1), abs=1e-6)


ONE = np.ones((16, 16), np.float32)


def test_pixels_of_weight_0_do_not_count():
    a = np.full((16, 16, 3), 0.5, np.float32)
    b = a + np.float32(0.1)
    b[:8] = 1
    weight = ONE.copy()
    weight[:8] = 0
    assert metrics.psnr(a, b, weight) == pytest.approx(20, abs=1e-4)  # a uniform error of a tenth; float32's 0.1
    assert metrics.psnr(a, a, ONE) is None
    with pytest.raises(ValueError, match="weight is 0"):
        metrics.psnr(a, b, 0 * ONE)


def test_colour_correction_undoes_a_change_of_exposure():
    rng = np.random.default_rng(0)
    picture = rng.uniform(0.2, 0.6, (16, 16, 3)).astype(np.float32)
    photo = picture * [1.2, 1.0, 0.8] + [0.05, 0, -0.02]
    np.testing.assert_allclose(metrics.correct_colours(picture, photo, ONE), photo, atol=1e-6)
