"""Terms of a view's uncertainty against float64 and by hand, how they are weighed, and whether they tell errors."""

import math
from itertools import combinations

import numpy as np
import pytest

from dav_gswt.views import uncertainty as un

FLOAT32 = 1e-5  # tolerance of a float32 kernel against float64


def w2_by_pairs(means):
    """The definition, pair by pair in float64."""
    mu = means.astype(float)
    return np.mean([((mu[:, i] - mu[:, j]) ** 2).sum(1) for i, j in combinations(range(mu.shape[1]), 2)], axis=0)


def normal(*shape, seed=0):
    return np.random.default_rng(seed).standard_normal(shape, dtype=np.float32)


def test_w2_is_the_mean_squared_distance_over_the_pairs_of_samples():
    latents = np.zeros((1, 2, 2, 1, 2), np.float32)
    latents[0, 1, :, 0, 0] = 3, 4
    scores, maps = un.w2_sq(latents)
    np.testing.assert_array_equal(maps, [[[25, 0]]])
    np.testing.assert_array_equal(scores, [12.5])
    three = np.array([0, 1, 3], np.float32).reshape(1, 3, 1, 1, 1)
    assert un.w2_sq(three)[0][0] == pytest.approx((1 + 4 + 9) / 3, rel=1e-6)
    equal = np.repeat(normal(1, 1, 4, 8, 8), 7, 1)
    assert not un.w2_sq(equal)[1].any()  # exactly 0


@pytest.mark.parametrize("scale, shift", [(1e-12, 0.0), (1.0, 1e6), (1e6, 0.0)])
def test_w2_in_float32_equals_the_pair_loop_in_float64(scale, shift):
    latents = normal(3, 5, 4, 6, 7) * np.float32(scale) + np.float32(shift)
    scores, maps = un.w2_sq(latents)
    truth = w2_by_pairs(latents)
    np.testing.assert_allclose(maps, truth, rtol=FLOAT32)
    np.testing.assert_allclose(scores, truth.mean((1, 2)), rtol=FLOAT32)
    assert maps.dtype == np.float32 and (maps >= 0).all()


@pytest.mark.parametrize("bad", [np.nan, 1e30], ids=str)  # whose square is infinite
def test_latents_that_are_not_finite_are_an_error_that_names_the_poses(bad):
    latents = normal(9, 3, 2, 4, 4)
    latents[[2, 7], 1, 0, 3, 3] = bad
    with pytest.raises(ValueError, match=r"not finite: the latents.*of pose c0042, c0047$"):
        un.w2_sq(latents, names=[f"c{i:04}" for i in range(40, 49)])
    latents[:, 0, 0, 0, 0] = bad
    with pytest.raises(ValueError, match=r"of pose 0, 1, 2, 3, 4 and 4 more$"):
        un.w2_sq(latents)


def grey(values, m=2):
    """m equal grey pictures of one pose."""
    return np.repeat(np.repeat(np.asarray(values, np.float32)[None, None, ..., None], 3, -1), m, 1)


def test_a_ramp_has_its_slope_within_the_border_and_none_across_it_and_a_diagonal_one_the_norm_of_both():
    ramp = -3 * np.tile(np.arange(10.0), (6, 1)) + 0.3
    found = un.gradient_map(ramp[None])[0]
    np.testing.assert_allclose(found[:, 1:-1], 3, rtol=1e-12)
    np.testing.assert_allclose(found[:, [0, -1]], 0, atol=1e-12)
    np.testing.assert_allclose(un.gradient_map(ramp.T[None])[0], found.T, rtol=1e-12)
    assert un.image_gradient(grey(ramp))[0] == pytest.approx(3 * 8 / 10, rel=1e-6)
    rows, columns = np.mgrid[:9, :9].astype(float)
    np.testing.assert_allclose(un.gradient_map((3 * rows + 4 * columns)[None])[0, 1:-1, 1:-1], 5, rtol=1e-12)


def table(n=40, seed=0):
    rng = np.random.default_rng(seed)
    terms = {"w2_sq": rng.lognormal(-3, 1, n), "lpips": rng.uniform(0, 0.5, n), "gradient": rng.uniform(0, 0.1, n)}
    return terms, un.Scales.from_terms(terms)


def test_a_scale_is_the_median_of_what_is_not_0_and_a_term_that_is_0_everywhere_weighs_nothing(caplog):
    assert un.robust_scale(np.array([0, 0, 0, 1.0, -2.0, 9.0, 0, 0])) == 2
    assert un.robust_scale(np.array([1.0, 2.0, 1e30])) == 2
    assert un.robust_scale(np.zeros(3)) == 0 and un.robust_scale(np.zeros(0)) == 0
    terms, _ = table()
    terms["lpips"] = np.zeros(40)
    scales = un.Scales.from_terms(terms)
    assert "lpips is 0 at every candidate" in caplog.text and scales.by_term["lpips"] == 0
    for lpips in (terms["lpips"], np.linspace(0, 1, 40)):  # of this round, and of a later one
        u = un.combine_terms(terms["w2_sq"], lpips, 5.0, scales)
        np.testing.assert_array_equal(u, terms["w2_sq"] / scales.by_term["w2_sq"])


def test_lam_weighs_lpips_over_its_scale_against_w2_or_the_gradient_over_theirs(caplog):
    terms, scales = table()
    for name in ("w2_sq", "gradient"):
        expected = terms[name] / scales.by_term[name] + 0.1 * terms["lpips"] / scales.by_term["lpips"]
        np.testing.assert_allclose(
            un.combine_terms(terms[name], terms["lpips"], 0.1, scales, name=name), expected, rtol=1e-12
        )
    u = un.combine_terms(terms["w2_sq"], terms["lpips"], 1e300, scales)
    np.testing.assert_array_equal(np.argsort(u), np.argsort(terms["lpips"]))
    u = un.combine_terms(terms["w2_sq"], None, 0.0, scales)
    np.testing.assert_array_equal(u, terms["w2_sq"] / scales.by_term["w2_sq"])
    assert not caplog.text  # a term that is lacking is left out, which is said if it was asked for
    np.testing.assert_array_equal(un.combine_terms(terms["w2_sq"], None, 0.1, scales), u)
    assert "the scores lack LPIPS" in caplog.text


def test_normalised_goes_from_0_at_the_low_quantile_to_1_at_the_high_one():
    quantiles = un.Quantiles(2.0, 4.0)
    np.testing.assert_array_equal(un.normalise(np.array([-9.0, 2, 3, 4, 1e30]), quantiles), [0, 0, 0.5, 1, 1])
    maps = np.array([[[2.0, 3.0]], [[4.0, 5.0]]], np.float32)
    np.testing.assert_array_equal(un.normalise(maps, quantiles), [[[0, 0.5]], [[1, 1]]])
    equal = un.Quantiles.from_values(np.full(10, 3.0))
    np.testing.assert_array_equal(un.normalise(np.array([2.0, 3.0, 3.1]), equal), [0, 0, 1])
    assert un.Quantiles.from_values(np.arange(101.0)) == un.Quantiles(5.0, 95.0)
    for ends in ((2.0, 1.0), (math.nan, 1.0), (0.0, math.nan)):
        with pytest.raises(ValueError, match="quantile"):
            un.Quantiles(*ends)


def test_gamma_is_the_papers_for_slope_2_symmetric_about_the_middle_and_finite_for_every_number():
    u = np.linspace(0, 1, 11)
    np.testing.assert_allclose(un.gamma(u), 1 - 1 / (1 + np.exp(-2 * (u - 0.5))), rtol=1e-12)
    np.testing.assert_allclose(un.gamma(u.astype(np.float32)), un.gamma(u), rtol=1e-6)
    assert un.gamma(u.astype(np.float32)).dtype == np.float32
    np.testing.assert_allclose(un.gamma(u, 7.0) + un.gamma(1 - u, 7.0), 1, atol=1e-12)
    assert un.gamma(u, 7.0)[0] == pytest.approx(1 / (1 + np.exp(-3.5)))
    for kind in (np.float32, np.float64):
        far = np.array([-1e8, 1e8, -np.finfo(kind).max / 4, np.finfo(kind).max / 4], kind)
        with np.errstate(all="raise", under="ignore"):
            np.testing.assert_allclose(un.gamma(far), [1, 0, 1, 0], atol=1e-30)
    with pytest.raises(ValueError, match="not a number"):
        un.gamma(np.array([0.5, np.nan]))
