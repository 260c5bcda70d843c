"""The scale of a texture, on noise whose correlation is known, and what follows for tiles."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dav_gswt.tiles import texture


def noise(width, cells=256, seed=0):
    values = np.random.default_rng(seed).normal(size=(cells, cells, 3))
    soft = np.stack([gaussian_filter(values[..., c], width, mode="wrap") for c in range(3)], -1)
    return 0.5 + 0.1 * soft / soft.std()


@pytest.mark.parametrize("width", [1.5, 5])
def test_blurred_noise_has_the_scale_that_its_correlation_says(width):
    # r = exp(-d^2 / 4 s^2) to where it is .1: 2 int r d = 4 s^2 (1 - .1)
    assert texture.measure_texture_scale(noise(width)) == pytest.approx(2 * width * np.sqrt(0.9), rel=0.12)


def test_neither_brightness_nor_contrast_nor_a_trend_changes_the_scale():
    ground = noise(3)
    y, x = np.mgrid[-1:1:256j, -1:1:256j]
    scale = texture.measure_texture_scale(ground)
    assert texture.measure_texture_scale(0.2 + 0.1 * ground) == pytest.approx(scale)
    assert texture.measure_texture_scale(ground + 0.3 * (x + y)[..., None]) == pytest.approx(scale, rel=0.1)


@pytest.mark.parametrize("ground", [np.zeros((40, 40, 3)), np.full((40, 40, 3), 0.1), np.full((10, 10, 3), 1 / 3)])
def test_even_ground_has_no_scale(ground):
    assert texture.measure_texture_scale(ground) == 0


def test_tiles_get_smaller_and_strips_wider_with_the_scale():
    assert texture.choose_sizes(0.0) == texture.choose_sizes(texture.SCALES[0]) == (0.5, 0.06)
    assert texture.choose_sizes(0.022) == pytest.approx((0.44, 1.6 * 0.022 / 0.44))
    assert texture.choose_sizes(texture.SCALES[1])[0] == 0.38 and texture.choose_sizes(0.3) == (0.38, 0.125)
