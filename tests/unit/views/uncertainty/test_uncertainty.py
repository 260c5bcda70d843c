"""The terms of a view's uncertainty against float64 and by hand, and how they are weighed."""

import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.views import uncertainty as un

FLOAT32 = 1e-5  # tolerance of a float32 kernel against float64: docs/research/numerics.md


def normal(*shape, seed=0):
    return np.random.default_rng(seed).standard_normal(shape, dtype=np.float32)


def whole(seed, *shape):
    """Small whole numbers: sums and differences of them are exact."""
    return np.random.default_rng(seed).integers(-8, 9, shape).astype(np.float32)


# --- W2


def test_w2_of_two_samples_is_their_squared_distance():
    latents = np.zeros((1, 2, 2, 1, 2), np.float32)
    latents[0, 1, :, 0, 0] = 3, 4
    scores, maps = un.w2_sq(latents)
    np.testing.assert_array_equal(maps, [[[25, 0]]])
    np.testing.assert_array_equal(scores, [12.5])


def test_w2_of_three_samples_is_the_mean_over_their_pairs():
    latents = np.array([0, 1, 3], np.float32).reshape(1, 3, 1, 1, 1)
    assert un.w2_sq(latents)[0][0] == pytest.approx((1 + 4 + 9) / 3, rel=1e-6)


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1.0, 1e6])
@pytest.mark.parametrize("shift", [0.0, 1.0, 1e6])
def test_w2_in_float32_equals_the_pair_loop_in_float64(scale, shift):
    latents = normal(3, 5, 4, 6, 7) * np.float32(scale) + np.float32(shift)
    variances = (normal(3, 5, 4, 6, 7, seed=1) * np.float32(scale) + np.float32(shift)) ** 2
    for given_variances in (None, variances):
        scores, maps = un.w2_sq(latents, given_variances)
        truth = un.w2_sq_by_pairs(latents, given_variances)
        np.testing.assert_allclose(maps, truth, rtol=FLOAT32)
        np.testing.assert_allclose(scores, truth.mean((1, 2)), rtol=FLOAT32)
        assert maps.dtype == np.float32 and (maps >= 0).all()


def test_w2_holds_deviations_where_the_printed_formula_cancels():
    means, variances = np.zeros((1, 2, 1, 1, 1), np.float32), np.zeros((1, 2, 1, 1, 1), np.float32)
    variances[0, :, 0, 0, 0] = np.array([1e6, 1e6 + 1]) ** 2
    assert un.w2_sq_as_printed(means, variances)[0, 0, 0] == -131072
    # 0.07: (1e6 + 1)^2 rounds to a multiple of 65536 in float32, its root by up to 0.033, the square of 1 by 0.066
    assert un.w2_sq(means, variances)[0][0] == pytest.approx(1, abs=0.07)


def test_the_printed_formula_agrees_where_it_is_safe():
    means, variances = normal(2, 4, 3, 5, 5), normal(2, 4, 3, 5, 5, seed=1) ** 2
    np.testing.assert_allclose(un.w2_sq_as_printed(means, variances), un.w2_sq(means, variances)[1], rtol=1e-4)


@pytest.mark.parametrize("m", [2, 3, 5, 7, 10])
@pytest.mark.parametrize("scale", [1e-12, 0.1, 1e6])
def test_w2_is_exactly_0_where_all_samples_agree_and_only_there(m, scale):
    one = normal(4, 1, 4, 8, 8) * np.float32(scale)
    latents = np.repeat(one, m, 1)
    scores, maps = un.w2_sq(latents, latents**2)
    assert (scores == 0).all() and (maps == 0).all()
    latents[2, -1, 1, 3, 4] *= np.float32(1.001)
    scores, maps = un.w2_sq(latents)
    assert list(np.flatnonzero(scores)) == [2] and list(np.argwhere(maps)[0]) == [2, 3, 4]


@given(seed=st.integers(0, 10_000), shift=st.integers(-1000, 1000), power=st.integers(-30, 20), m=st.integers(2, 10))
@settings(max_examples=30)
def test_w2_ignores_a_shift_and_grows_with_the_square_of_a_factor(seed, shift, power, m):
    latents = whole(seed, 2, m, 3, 2, 2)
    scores, maps = un.w2_sq(latents)
    moved, moved_maps = un.w2_sq(latents + np.float32(shift))
    np.testing.assert_array_equal(moved_maps, maps)  # whole numbers: the shift is exact
    np.testing.assert_array_equal(moved, scores)
    np.testing.assert_array_equal(un.w2_sq(latents * np.float32(2.0**power))[1], maps * np.float32(4.0**power))


@given(seed=st.integers(0, 10_000), m=st.integers(2, 6))
@settings(max_examples=30)
def test_w2_does_not_depend_on_the_order_of_samples_nor_a_pose_on_its_batch(seed, m):
    latents = normal(5, m, 2, 3, 3, seed=seed)
    scores, maps = un.w2_sq(latents)
    order = np.random.default_rng(seed).permutation(m)
    np.testing.assert_allclose(un.w2_sq(latents[:, order])[1], maps, rtol=FLOAT32)
    np.testing.assert_array_equal(un.w2_sq(latents[3:4])[0], scores[3:4])


def test_w2_in_several_chunks_equals_w2_in_one(monkeypatch):
    latents = normal(7, 3, 4, 5, 5)
    together = un.w2_sq(latents)
    monkeypatch.setattr("dav_gswt.views.uncertainty.disagreement.CHUNK", 2 * 3 * 4 * 5 * 5)
    for a, b in zip(un.w2_sq(latents), together, strict=True):
        np.testing.assert_array_equal(a, b)


def test_w2_works_on_a_few_megabytes_at_a_time():
    latents = normal(60, 5, 4, 64, 64)  # 20 MB
    tracemalloc.start()
    un.w2_sq(latents)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 6e6  # 1 MB of maps, and some times the chunk of 1 MB


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e30], ids=str)
def test_latents_that_are_not_finite_are_an_error_that_names_the_poses(bad):
    latents = normal(9, 3, 2, 4, 4)
    latents[[2, 7], 1, 0, 3, 3] = bad
    with pytest.raises(ValueError, match=r"not finite: the latents.*of pose 2, 7$"):
        un.w2_sq(latents)
    with pytest.raises(ValueError, match=r"of pose c0042, c0047$"):
        un.w2_sq(latents, names=[f"c{i:04}" for i in range(40, 49)])
    latents[:, 0, 0, 0, 0] = bad
    with pytest.raises(ValueError, match=r"of pose 0, 1, 2, 3, 4 and 4 more$"):
        un.w2_sq(latents)


def test_a_single_sample_and_a_negative_variance_are_refused():
    for measure in (un.w2_sq, un.w2_sq_by_pairs):
        with pytest.raises(ValueError, match="at least 2 samples of a pose, not 1"):
            measure(normal(3, 1, 2, 4, 4))
    variances = normal(3, 2, 2, 4, 4) ** 2
    variances[1, 1, 0, 0, 0] = -1e-3
    with pytest.raises(ValueError, match="variance below 0 of pose b$"):
        un.w2_sq(normal(3, 2, 2, 4, 4), variances, names=["a", "b", "c"])


def test_no_pose_has_no_score():
    scores, maps = un.w2_sq(normal(0, 3, 4, 8, 8))
    assert scores.shape == (0,) and maps.shape == (0, 8, 8)


# --- the gradient of the picture


def grey(values, m=2):
    """m equal grey pictures of one pose."""
    return np.repeat(np.repeat(np.asarray(values, np.float32)[None, None, ..., None], 3, -1), m, 1)


def test_a_constant_picture_has_no_gradient():
    for value in (0.0, 0.3, 1e6):
        assert un.image_gradient(grey(np.full((8, 9), value)))[0] == 0


@pytest.mark.parametrize("slope", [1.0, 0.01, -3.0])
def test_a_ramp_has_its_slope_within_the_border_and_none_across_it(slope):
    ramp = slope * np.tile(np.arange(10.0), (6, 1))
    found = un.gradient_map(ramp[None])[0]
    np.testing.assert_allclose(found[:, 1:-1], abs(slope), rtol=1e-12)
    np.testing.assert_allclose(found[:, [0, -1]], 0, atol=1e-12)
    np.testing.assert_allclose(un.gradient_map(ramp.T[None])[0], found.T, rtol=1e-12)
    assert un.image_gradient(grey(ramp))[0] == pytest.approx(abs(slope) * 8 / 10, rel=1e-6)
    assert un.image_gradient(grey(ramp), squared=True)[0] == pytest.approx(slope**2 * 8 / 10, rel=1e-6)


def test_a_diagonal_ramp_has_the_norm_of_both_slopes():
    rows, columns = np.mgrid[:9, :9].astype(float)
    np.testing.assert_allclose(un.gradient_map((3 * rows + 4 * columns)[None])[0, 1:-1, 1:-1], 5, rtol=1e-12)


@pytest.mark.parametrize("factor", [1e-12, 0.5, -2.0, 1e6])
def test_the_gradient_of_a_times_the_picture_is_a_times_the_gradient(factor):
    pictures = np.random.default_rng(0).uniform(0, 1, (3, 2, 12, 10, 3)).astype(np.float32)
    scaled = pictures * np.float32(factor)
    for squared, power in ((False, 1), (True, 2)):
        once = un.image_gradient(pictures, squared=squared)
        np.testing.assert_allclose(un.image_gradient(scaled, squared=squared), once * abs(factor) ** power, rtol=1e-5)


def test_the_gradient_is_that_of_the_mean_picture():
    ramp = np.tile(np.arange(8.0), (8, 1))
    both = np.concatenate([grey(ramp, 1), grey(-ramp, 1)], 1)
    assert un.image_gradient(both)[0] == 0 and un.image_gradient(both[:, :1])[0] > 0


def test_the_gradient_in_several_chunks_equals_that_in_one(monkeypatch):
    pictures = np.random.default_rng(0).uniform(0, 1, (5, 2, 8, 8, 3)).astype(np.float32)
    together = un.image_gradient(pictures)
    monkeypatch.setattr("dav_gswt.views.uncertainty.texture.CHUNK", 1)
    np.testing.assert_array_equal(un.image_gradient(pictures), together)


def test_pictures_that_are_not_finite_or_too_small_are_refused():
    pictures = grey(np.zeros((4, 4)))
    pictures[0, 1, 2, 2, 0] = np.nan
    with pytest.raises(ValueError, match="not finite: the decoded pictures of pose north"):
        un.image_gradient(pictures, names=["north"])
    with pytest.raises(ValueError, match="2 x 2 pixels, not 2 of 5 x 1"):
        un.image_gradient(grey(np.zeros((1, 5))))


# --- scales and sums


def table(n=40, seed=0):
    rng = np.random.default_rng(seed)
    terms = {"w2_sq": rng.lognormal(-3, 1, n), "lpips": rng.uniform(0, 0.5, n), "gradient": rng.uniform(0, 0.1, n)}
    return terms, un.Scales.from_terms(terms)


def test_a_scale_is_the_median_of_what_is_not_0():
    assert un.robust_scale(np.array([0, 0, 0, 1.0, -2.0, 9.0, 0, 0])) == 2
    assert un.robust_scale(np.array([1.0, 2.0, 1e30])) == 2
    assert un.robust_scale(np.zeros(3)) == 0 and un.robust_scale(np.zeros(0)) == 0


def test_a_term_that_is_0_everywhere_is_said_and_weighs_nothing(caplog):
    terms, _ = table()
    terms["lpips"] = np.zeros(40)
    scales = un.Scales.from_terms(terms)
    assert "lpips is 0 at every candidate" in caplog.text and scales.by_term["lpips"] == 0
    later = np.linspace(0, 1, 40)  # at a later round it may be more than 0: it has no scale, so it still weighs nothing
    for lpips in (terms["lpips"], later):
        u = un.combine_terms(terms["w2_sq"], lpips, 5.0, scales)
        np.testing.assert_array_equal(u, terms["w2_sq"] / scales.by_term["w2_sq"])


def test_lam_0_ranks_by_w2_and_a_large_one_by_lpips():
    terms, scales = table()
    w2, lpips = terms["w2_sq"], terms["lpips"]
    np.testing.assert_array_equal(np.argsort(un.combine_terms(w2, lpips, 0.0, scales)), np.argsort(w2))
    for lam in (1e12, 1e300):
        np.testing.assert_array_equal(np.argsort(un.combine_terms(w2, lpips, lam, scales)), np.argsort(lpips))


@given(seed=st.integers(0, 1000), power=st.integers(-40, 40), lam=st.floats(0, 100))
@settings(max_examples=30)
def test_a_latent_space_in_other_units_ranks_alike(seed, power, lam):
    latents, lpips = normal(12, 3, 2, 4, 4, seed=seed), np.random.default_rng(seed).uniform(0, 1, 12)
    ranks = []
    for factor in (1.0, 2.0**power):
        w2 = un.w2_sq(latents * np.float32(factor))[0]
        scales = un.Scales.from_terms({"w2_sq": w2, "lpips": lpips})
        ranks.append(np.argsort(un.combine_terms(w2, lpips, lam, scales), kind="stable"))
    np.testing.assert_array_equal(*ranks)


def test_without_weights_the_term_is_left_out_and_said_if_it_was_asked_for(caplog):
    terms, scales = table()
    u = un.combine_terms(terms["w2_sq"], None, 0.0, scales)
    np.testing.assert_array_equal(u, terms["w2_sq"] / scales.by_term["w2_sq"])
    assert not caplog.text
    np.testing.assert_array_equal(un.combine_terms(terms["w2_sq"], None, 0.1, scales), u)
    assert "the scores lack LPIPS" in caplog.text


def test_u_img_has_the_gradient_in_place_of_w2_and_the_appendix_adds_both():
    terms, scales = table()
    u_img = un.combine_image_terms(terms["gradient"], terms["lpips"], 0.1, scales)
    expected = terms["gradient"] / scales.by_term["gradient"] + 0.1 * terms["lpips"] / scales.by_term["lpips"]
    np.testing.assert_allclose(u_img, expected, rtol=1e-12)


def test_sums_refuse_what_has_no_meaning():
    terms, scales = table()
    w2, lpips = terms["w2_sq"], terms["lpips"]
    for lam in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError, match="lam must be"):
            un.combine_terms(w2, lpips, lam, scales)
    with pytest.raises(ValueError, match="lpips has no frozen scale"):
        un.combine_terms(w2, lpips, 0.1, un.Scales({"w2_sq": 1.0}))
    lpips[[3, 5]] = np.nan
    names = [f"a{i}" for i in range(40)]
    for call in (
        lambda: un.combine_terms(w2, lpips, 0.1, scales, names),
        lambda: un.Scales.from_terms({"w2_sq": w2, "lpips": lpips}, names),
    ):
        with pytest.raises(ValueError, match="not finite: lpips of pose a3, a5"):
            call()
    with pytest.raises(ValueError, match="scale of lpips"):
        un.Scales({"w2_sq": 1.0, "lpips": math.nan})


@pytest.mark.parametrize("ends", [(2.0, 1.0), (math.nan, 1.0), (0.0, math.nan)])
def test_quantiles_in_the_wrong_order_are_refused(ends):
    with pytest.raises(ValueError, match="quantile"):
        un.Quantiles(*ends)


# --- normalised, gamma


def test_normalised_goes_from_0_at_the_low_quantile_to_1_at_the_high_one():
    quantiles = un.Quantiles(2.0, 4.0)
    np.testing.assert_array_equal(un.normalise(np.array([-9.0, 2, 3, 4, 1e30]), quantiles), [0, 0, 0.5, 1, 1])
    maps = np.array([[[2.0, 3.0]], [[4.0, 5.0]]], np.float32)
    np.testing.assert_array_equal(un.normalise(maps, quantiles), [[[0, 0.5]], [[1, 1]]])
    maps[1, 0, 1] = np.nan
    with pytest.raises(ValueError, match="of pose 1"):
        un.normalise(maps, quantiles)


def test_equal_uncertainty_everywhere_is_normalised_to_0_or_1_never_nan():
    quantiles = un.Quantiles.from_values(np.full(10, 3.0))
    np.testing.assert_array_equal(un.normalise(np.array([2.0, 3.0, 3.1]), quantiles), [0, 0, 1])


def test_quantiles_are_those_of_the_candidates():
    assert un.Quantiles.from_values(np.arange(101.0)) == un.Quantiles(5.0, 95.0)
    with pytest.raises(ValueError, match="at least one value"):
        un.Quantiles.from_values(np.zeros(0))
    with pytest.raises(ValueError, match="of pose 1"):
        un.Quantiles.from_values(np.array([0.0, np.nan]))


@given(st.floats(0, 1, width=32), st.floats(0, 50, width=32))
@settings(max_examples=60)
def test_gamma_is_a_half_in_the_middle_and_symmetric_about_it(u, slope):
    for kind, tolerance in ((np.float32, 2e-6), (np.float64, 1e-12)):
        a = np.array([u, 0.5], kind)
        both = un.gamma(a, slope) + un.gamma(1 - a, slope)
        np.testing.assert_allclose(both, 1, atol=tolerance + slope * np.finfo(kind).eps)
        assert un.gamma(a, slope)[1] == 0.5 and both.dtype == kind


def test_gamma_is_the_papers_and_falls_with_u():
    u = np.linspace(0, 1, 11)
    np.testing.assert_allclose(un.gamma(u), 1 - 1 / (1 + np.exp(-2 * (u - 0.5))), rtol=1e-12)
    np.testing.assert_allclose(un.gamma(u.astype(np.float32)), un.gamma(u), rtol=1e-6)
    assert (np.diff(un.gamma(u)) < 0).all()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_gamma_is_finite_for_every_number_and_refuses_nan(kind):
    far = np.array([-1e8, 1e8, -np.finfo(kind).max / 4, np.finfo(kind).max / 4], kind)
    with np.errstate(all="raise", under="ignore"):
        np.testing.assert_allclose(un.gamma(far), [1, 0, 1, 0], atol=1e-30)
    with pytest.raises(ValueError, match="not a number"):
        un.gamma(np.array([0.5, np.nan], kind))
