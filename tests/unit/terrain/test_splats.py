"""Gaussians draped over a surface against its differences; splats in a given order against render and by hand."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.lod.merge import compute_covariances
from dav_gswt.raster import render
from dav_gswt.terrain import stills
from dav_gswt.terrain.heights import Hills, displace_field

ORIGIN = np.zeros(3)
HILLS = Hills(1.5, 6.0, 3, 4)
CAMERA = cameras.pinhole([0.0, 0, 0], [1, 0.2, -0.3], 64, 40, 60.0)


def made(n, seed=0, coefficients=1):
    """Gaussians 4 to 9 units away in all of the picture and beyond its rim."""
    rng = np.random.default_rng(seed)
    means = np.stack([rng.uniform(4, 9, n), rng.uniform(-4, 5, n), rng.uniform(-5, 3, n)], 1)
    sh = np.concatenate([rgb_to_sh(rng.uniform(size=(n, 3))), rng.normal(0, 0.2, (n, coefficients - 1, 3))], 1)
    return GaussianField(
        means.astype(np.float32),
        np.log(rng.uniform(0.01, 0.4, (n, 3))).astype(np.float32),
        rng.normal(size=(n, 4)).astype(np.float32),
        rng.normal(1, 2, n).astype(np.float32),
        sh.astype(np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def test_shapes_follow_the_surface_s_own_differences():
    """J of the map p -> p + h(p) by differences, at each centre: nothing of `heights`' derivatives is used."""
    field = made(40, seed=2)
    corner, origin = np.array([1000.0, -700.0, 0.0]), np.array([999.0, -702.0, 3.0])
    seen, eps = displace_field(field, HILLS, corner, origin), 1e-4

    def moved(points):
        up, _ = HILLS.at(points[:, 0] + corner[0], points[:, 1] + corner[1])
        return points + up[:, None] * [0, 0, 1] + [1, 2, -3]

    at = field.means.astype(float)
    jacobian = np.stack([(moved(at + eps * e) - moved(at - eps * e)) / (2 * eps) for e in np.eye(3)], 2)
    np.testing.assert_allclose(seen.means, moved(at), atol=2e-6)
    expected = jacobian @ compute_covariances(field) @ jacobian.transpose(0, 2, 1)
    np.testing.assert_allclose(compute_covariances(seen), expected, atol=1e-6)


def test_draped_needles_and_discs_keep_their_digits():
    """Scale ratios of 1e6: the determinant of J is 1, so the product of the scales stays."""
    scales = np.log(np.array([[1.0, 1e-6, 1e-6], [1.0, 1.0, 1e-6], [1e3, 1e-3, 1.0]], np.float32))
    seen = displace_field(replace(made(3, seed=5), log_scales=scales), HILLS, ORIGIN, ORIGIN)
    np.testing.assert_allclose(seen.log_scales.astype(float).sum(1), scales.astype(float).sum(1), atol=2e-5)


def level(field):
    return np.zeros((len(field), 2))


@pytest.mark.parametrize("coefficients", [1, 4])
def test_sorted_by_depth_it_is_the_rasterizer_s_picture(coefficients):
    field = made(300, coefficients=coefficients)
    found, _ = stills.project(field, level(field), CAMERA, 0.01)
    seen = stills.blend(found[stills.depth_order(found)], CAMERA)
    expected = render(field, CAMERA)
    # both in float32; a pixel where an alpha is 1/255 to the last bits may take it in one of them: one or two do
    difference = np.abs(seen.colour - expected.colour)
    assert np.quantile(difference, 0.999) < 2e-4 and difference.max() < 2 / 255
    assert np.quantile(np.abs(seen.alpha - expected.alpha), 0.999) < 2e-4


def test_a_given_order_is_kept_however_wrong_it_is():
    """The nearest first: each splat of alpha a leaves 1 - a of those before it, to the farthest's own a."""
    field = made(3)
    means = CAMERA.rays()[1][20, 32] * np.array([[5], [6], [7]])  # through a pixel's middle
    field = replace(field, means=means.astype(np.float32), log_scales=np.zeros((3, 3), np.float32))
    ray = stills.blend(stills.project(field, level(field), CAMERA, 0.01)[0], CAMERA)
    expected = np.zeros(3)
    for alpha, colour in zip(1 / (1 + np.exp(-field.opacity_logits)), field.base_colours, strict=True):
        expected += alpha * (colour - expected)
    np.testing.assert_allclose(ray.colour[20, 32], expected, atol=1e-5)


def test_needles_keep_their_width():
    """A ratio of 1e6: the picture's determinant is a sum of squares, a difference would be noise."""
    needle = replace(made(1), means=np.array([[5, 0, 0]], np.float32))
    scales = np.log(np.array([[1.0, 1e-6, 1e-6]], np.float32))
    seen, _ = stills.project(replace(needle, log_scales=scales), level(needle), CAMERA, 0.01)
    assert np.exp(seen.log_scales[0, 0]) > 1 and 1e-6 < np.exp(seen.log_scales[0, 1]) < 1e-4
