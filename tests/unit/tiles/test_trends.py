"""Trends of known shape are taken out, and local relief is left."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dav_gswt.lod.merge import compute_covariances
from dav_gswt.tiles import poisson_blending, texture
from dav_gswt.tiles.layout import Layout


def test_detrending_flattens_a_slope_and_keeps_mean_and_cover(sample_ground):
    field = sample_ground.levels[0]
    ground = field[field.ground]
    e = sample_ground.exemplar
    x = np.mgrid[: e.cells, : e.cells][1] * e.spacing
    tilted = ground.means.copy()
    tilted[:, 2] = 0.4 * x.ravel()
    trend = texture.fit_trend(np.full((e.cells, e.cells, 3), np.nan), 0.4 * x, e, 10.0)
    flat = texture.remove_trend(type(ground)(**{**vars(ground), "means": tilted}), trend)
    np.testing.assert_allclose(flat.means[:, 2], 0.4 * x.mean(), atol=1e-5)  # float32 heights up to 5
    # z' = z - 0.4 x shears a flat disc: var z' = 0.16 var x + var z, cov = -0.4 var x
    before, after = compute_covariances(ground)[0], compute_covariances(flat)[0]
    np.testing.assert_allclose(after[0, 0], before[0, 0], rtol=1e-4)  # float32 logarithms
    np.testing.assert_allclose(after[0, 2], -0.4 * before[0, 0], rtol=1e-4)
    np.testing.assert_allclose(after[2, 2], 0.16 * before[0, 0] + before[2, 2], rtol=1e-4)
    np.testing.assert_array_equal(flat.sh, ground.sh)


PLAN = Layout(exemplar=64, levels=1, side=24, strip=6, corner=9)


def flat_ground(step):
    """An exemplar whose right half is brighter by `step`, far under the limit."""
    values = np.full((64, 64, 4), 0.5)
    values[:, 32:] += step
    return poisson_blending.SoftMaps(values, 1e3)


def patched():
    """A square of the bright half in the middle of the dark one."""
    labels = np.zeros((24, 24), np.uint8)
    labels[8:16, 8:16] = 1
    shift = np.zeros((9, 2), int)
    shift[1] = [38, 0]
    return labels, shift


def test_a_bright_patch_in_a_dark_frame_is_darkened_by_the_step():
    labels, shift = patched()
    found = poisson_blending.solve_tile(labels, shift, np.zeros((24, 24, 4)), PLAN, flat_ground(0.1))
    # the source is divergence of an exact gradient, so its solution is the step itself; limit 1e3 takes 1e-8 of it
    np.testing.assert_allclose(found, np.where(labels[..., None], -0.1, 0) * np.ones(4), atol=1e-7)


def noise(width, cells=256, seed=0):
    values = np.random.default_rng(seed).normal(size=(cells, cells, 3))
    soft = np.stack([gaussian_filter(values[..., c], width, mode="wrap") for c in range(3)], -1)
    return 0.5 + 0.1 * soft / soft.std()


@pytest.mark.parametrize("width", [1.5, 5])
def test_blurred_noise_has_the_scale_that_its_correlation_says(width):
    # r = exp(-d^2 / 4 s^2) to where it is .1: 2 int r d = 4 s^2 (1 - .1)
    assert texture.measure_texture_scale(noise(width)) == pytest.approx(2 * width * np.sqrt(0.9), rel=0.12)


def test_tiles_get_smaller_and_strips_wider_with_the_scale():
    assert texture.choose_sizes(0.0) == texture.choose_sizes(texture.SCALES[0]) == (0.5, 0.06)
    assert texture.choose_sizes(0.022) == pytest.approx((0.44, 1.6 * 0.022 / 0.44))
    assert texture.choose_sizes(texture.SCALES[1])[0] == 0.38 and texture.choose_sizes(0.3) == (0.38, 0.125)
