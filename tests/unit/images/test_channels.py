"""Arithmetic on images of few channels: the same bits as NumPy's broadcasting."""

import numpy as np
import pytest

from dav_gswt.images import channels


@pytest.fixture
def image():
    return np.random.default_rng(0).normal(size=(5, 7, 3)).astype(np.float32)


@pytest.fixture
def alpha():
    return np.random.default_rng(1).uniform(size=(5, 7)).astype(np.float32)


@pytest.mark.parametrize("shape", [(3,), (5, 7, 3)])
def test_composite(image, alpha, shape):
    behind = np.random.default_rng(2).uniform(size=shape).astype(np.float32)
    expected = image + (1 - alpha)[..., None] * behind
    found = channels.composite(image, alpha, behind)
    assert found.dtype == np.float32 and np.array_equal(found, expected)


def test_composite_leaves_its_inputs(image, alpha):
    before = image.copy(), alpha.copy()
    channels.composite(image, alpha, np.zeros(3, np.float32))
    assert np.array_equal(image, before[0]) and np.array_equal(alpha, before[1])


def test_scale_channels(image):
    gain, offset = np.float32([0.5, 1.5, 2.5]), np.float32([0.1, -0.2, 0.3])
    assert np.array_equal(channels.scale_channels(image, gain), image * gain)
    assert np.array_equal(channels.scale_channels(image, gain, offset), image * gain + offset)


def test_scale_channels_of_part_of_an_image(image):
    part, gain = image[::2, ::3], np.float32([0.5, 1.5, 2.5])
    assert np.array_equal(channels.scale_channels(part, gain), part * gain)


@pytest.mark.parametrize("shape", [(3,), (5, 7, 3)])
def test_sum_products(image, shape):
    other = np.random.default_rng(3).normal(size=shape).astype(np.float32)
    expected = (image.astype(float) * other).sum(-1)
    assert channels.sum_products(image, other) == pytest.approx(expected, abs=1e-6)


def test_fill_unknown(image):
    image[1, 2] = np.nan
    image[3, 4, 1] = np.nan
    colour = np.float32([0.25, 0.5, 0.75])
    assert np.array_equal(channels.fill_unknown(image, colour), np.where(np.isnan(image), colour, image))
    assert np.isnan(image[1, 2]).all()


def test_mean_squares(image):
    found = channels.mean_squares(image)
    assert found.dtype == np.float32 and found == pytest.approx((image.astype(float) ** 2).mean(-1), rel=1e-6)


def test_largest_difference(image):
    other = image[::-1]
    assert np.array_equal(channels.largest_difference(image, other), np.abs(image - other).max(-1))
