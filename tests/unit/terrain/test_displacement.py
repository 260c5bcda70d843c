"""Draping: bits on level ground, covariances against samples and against differences, upright things, no gaps."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.terrain.displacement import displace_field, displace_means, displaced_axes
from dav_gswt.terrain.heights import FlatSurface, Hills

ORIGIN = np.zeros(3)
HILLS = Hills(1.5, 6.0, 3, 4)


@dataclass(frozen=True)
class Slope:
    """A plane."""

    east: float
    north: float
    low: float = -np.inf
    high: float = np.inf
    steepest: float = np.inf

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        return self.east * x + self.north * y, np.tile([self.east, self.north], (len(x), 1))


def made(n, seed=0, spread=5.0, scales=(0.02, 0.4)):
    rng = np.random.default_rng(seed)
    return GaussianField(
        rng.uniform(-spread, spread, (n, 3)).astype(np.float32),
        np.log(rng.uniform(*scales, (n, 3))).astype(np.float32),
        rng.normal(size=(n, 4)).astype(np.float32),
        rng.normal(size=n).astype(np.float32),
        rgb_to_sh(rng.uniform(size=(n, 3))),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def covariances(field):
    """By the quaternion's formula, written out: a twin of what the library leaves to scipy."""
    w, x, y, z = (field.quats.astype(float) / np.linalg.norm(field.quats.astype(float), axis=1, keepdims=True)).T
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
    spread = turn * np.exp(field.log_scales.astype(float))[:, None]
    return spread @ spread.transpose(0, 2, 1)


def test_on_a_plain_every_bit_is_kept():
    field = made(50)
    same = displace_field(field, FlatSurface(), ORIGIN, ORIGIN)
    for name in ("means", "log_scales", "quats", "opacity_logits", "sh"):
        assert getattr(same, name).tobytes() == getattr(field, name).tobytes()


def test_a_sphere_on_a_slope_is_worked_by_hand():
    """Slope 1 to the east, Sigma = I: J J^T = [[1, 0, 1], [0, 1, 0], [1, 0, 2]] of eigenvalues (3 +- sqrt 5) / 2, 1."""
    ball = replace(made(1), means=np.array([[2, 3, 0.5]], np.float32), log_scales=np.zeros((1, 3), np.float32))
    seen = displace_field(ball, Slope(1.0, 0.0), ORIGIN, ORIGIN)
    np.testing.assert_array_equal(seen.means, [[2, 3, 2.5]])
    np.testing.assert_allclose(covariances(seen)[0], [[1, 0, 1], [0, 1, 0], [1, 0, 2]], atol=1e-6)
    golden = (1 + 5**0.5) / 2
    np.testing.assert_allclose(np.exp(np.sort(seen.log_scales[0])), [1 / golden, 1, golden], rtol=1e-6)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_covariances_are_those_of_samples_that_are_moved_one_by_one(east, north):
    """A plane moves points by J exactly, so the samples' covariance is J Sigma J^T, to float32's rounding."""
    field, slope = made(3, seed=1), Slope(east, north)
    seen = displace_field(field, slope, ORIGIN, ORIGIN)
    for before, after, old, new in zip(covariances(field), covariances(seen), field.means, seen.means, strict=True):
        # points with exactly the mean and covariance of the Gaussian: the ends of its axes, sqrt(3) out
        half = np.sqrt(3) * np.linalg.cholesky(before).T
        points = old.astype(float) + np.concatenate([half, -half])
        points[:, 2] += east * points[:, 0] + north * points[:, 1]
        np.testing.assert_allclose(points.mean(0), new, atol=2e-6 * 20)
        np.testing.assert_allclose(np.cov(points.T, bias=True), after, atol=1e-6 * np.trace(after))


def test_shapes_follow_the_surface_s_own_differences():
    """J of the map p -> p + h(p) by differences, at each centre: nothing of `heights`' derivatives is used."""
    field = made(40, seed=2)
    about = np.array([1000.0, -700.0, 0.0])
    seen, eps = displace_field(field, HILLS, about, about), 1e-4

    def moved(points):
        up, _ = HILLS.at(points[:, 0] + about[0], points[:, 1] + about[1])
        return points + up[:, None] * [0, 0, 1]

    at = field.means.astype(float)
    jacobian = np.stack([(moved(at + eps * e) - moved(at - eps * e)) / (2 * eps) for e in np.eye(3)], 2)
    np.testing.assert_allclose(seen.means, moved(at), atol=1e-6)
    expected = jacobian @ covariances(field) @ jacobian.transpose(0, 2, 1)
    np.testing.assert_allclose(covariances(seen), expected, atol=1e-6)


def test_the_axes_that_are_drawn_are_those_of_the_draped_field():
    field = made(30, seed=3)
    raised, slope = displace_means(field, HILLS, ORIGIN, ORIGIN)
    seen = displace_field(field, HILLS, ORIGIN, ORIGIN)
    spread = displaced_axes(field, slope)
    np.testing.assert_array_equal(raised.means, seen.means)
    np.testing.assert_allclose(spread @ spread.transpose(0, 2, 1), covariances(seen), atol=1e-6)


def test_needles_and_discs_keep_their_digits():
    """Scale ratios of 1e6: the determinant of J is 1, so the product of the scales stays."""
    scales = np.log(np.array([[1.0, 1e-6, 1e-6], [1.0, 1.0, 1e-6], [1e3, 1e-3, 1.0]], np.float32))
    field = replace(made(3, seed=5), log_scales=scales)
    seen = displace_field(field, Slope(0.8, -0.3), ORIGIN, ORIGIN)
    np.testing.assert_allclose(seen.log_scales.astype(float).sum(1), scales.astype(float).sum(1), atol=2e-5)


def test_what_stands_stands_upright_and_stays_in_its_column():
    field = made(60, seed=6)
    seen = displace_field(field, HILLS, ORIGIN, ORIGIN)
    np.testing.assert_array_equal(seen.means[:, :2], field.means[:, :2])
    ground, _ = HILLS.at(*field.means[:, :2].astype(float).T)
    np.testing.assert_allclose(seen.means[:, 2] - ground, field.means[:, 2], atol=1e-6)


def test_rotations_stay_rotations():
    """scipy would take a mirror image's matrix for some other rotation: covariances agree only if none is left."""
    field = made(200, seed=7)
    seen = displace_field(field, Slope(2.0, 1.0), ORIGIN, ORIGIN)
    np.testing.assert_allclose(np.linalg.norm(seen.quats, axis=1), 1, atol=1e-6)


def test_neighbouring_discs_on_a_slope_overlap_as_on_level_ground():
    """In standard deviations of their own covariance two discs are as far apart as they were: J moves both alike."""
    field = made(2, seed=8, spread=0.2)
    seen = displace_field(field, Slope(1.2, -0.7), ORIGIN, ORIGIN)
    apart = [np.diff(f.means.astype(float), axis=0)[0] for f in (field, seen)]
    before, after = (d @ np.linalg.solve(c[0], d) for d, c in zip(apart, map(covariances, (field, seen)), strict=True))
    assert after == pytest.approx(before, rel=1e-4)


def test_a_far_place_is_draped_as_finely_as_home():
    """4000 km out and 2000 km up: sums are float64's until they count from `about`."""
    pair = replace(made(2), means=np.array([[0, 0, 0], [2**-10, 0, 0]], np.float32))
    corner, about = np.array([4e6, -4e6, 0.0]), np.array([4e6 - 1, -4e6, 2e6])
    seen, _ = displace_means(pair, Slope(0.5, 0.0), corner, about)
    np.testing.assert_array_equal(seen.means, [[1, 0, 0], [1 + 2**-10, 0, 2**-11]])
