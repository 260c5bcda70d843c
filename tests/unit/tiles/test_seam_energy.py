"""Seam weights by hand, their properties, and exact cuts of them."""

import numpy as np
import pytest
from fixtures.seams import cheapest
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.tiles import cuts, energy, semantics
from dav_gswt.tiles.energy import ColourLayer, LayerScales

UNIT = LayerScales(1.0, 1.0)
SHARES = st.sampled_from([0.0, 0.25, 0.5, 0.731, 1.0])


def where(x, y, h=4, w=4):
    rows, columns = np.mgrid[y : y + h, x : x + w]
    return rows, columns


def patches(*values):
    """Colours of an exemplar that shows patches side by side, gradients of each for itself; and where they lie."""
    h, w = values[0].shape[:2]
    slope = np.concatenate([energy.compute_gradients(v) for v in values], 1)
    layer = ColourLayer(np.concatenate(values, 1), slope, UNIT)
    return layer, [where(i * w, 0, h, w) for i in range(len(values))]


def noise_exemplar(seed, kind="semantic", side=12, dtype=float):
    """An exemplar of noise, in segments of 3 x 3 cells."""
    rng = np.random.default_rng(seed)
    colour = rng.random((side, side, 3)).astype(dtype)
    segments = np.kron(np.arange((side // 3) ** 2).reshape(side // 3, -1), np.ones((3, 3), int))
    return energy.SeamEnergy(
        kind,
        2.0,
        energy.make_colour_layer(colour),
        semantics.describe_segments(segments, colour.astype(float), None, {}),
    )


def test_weight_of_two_flat_patches_is_their_difference_over_eps():
    layer, (a, b) = patches(np.full((2, 2, 1), 0.5), np.full((2, 2, 1), 0.6))
    # d = 0.1 at both cells, no gradient: D / (0 + EPS)
    for cost in energy.compute_edge_costs([(1.0, layer)], a, b):
        np.testing.assert_allclose(cost, 0.2 / energy.EPS, rtol=1e-12)


def test_a_gradient_across_an_edge_makes_only_that_edge_cheaper():
    ramp = np.broadcast_to(np.arange(3.0)[None, :, None], (3, 3, 1))
    layer, (a, b) = patches(ramp, ramp + 0.1)
    right, upper = energy.compute_edge_costs([(1.0, layer)], a, b)
    # four gradients of 1 along x, none along y
    np.testing.assert_allclose(right, 0.2 / (4 + energy.EPS), rtol=1e-12)
    np.testing.assert_allclose(upper, 0.2 / energy.EPS, rtol=1e-12)


def test_both_terms_are_weighed_above_and_below():
    nothing, (a, b) = patches(np.zeros((2, 2, 1)), np.zeros((2, 2, 1)))
    step = np.array([0.0, 0, 1, 1])[None, :, None]
    one = ColourLayer(nothing.values + step, np.full((2, 4, 2), 0.5), LayerScales(2.0, 4.0))
    other = ColourLayer(nothing.values + 3 * step, np.full((2, 4, 2), 1.0), LayerScales(3.0, 2.0))
    # D = 2 / 2 and 6 / 3, G = 4 * 0.5 / 4 and 4 * 1 / 2
    for cost in energy.compute_edge_costs([(0.25, one), (0.75, other)], a, b):
        np.testing.assert_allclose(cost, (0.25 * 1 + 0.75 * 2) / (0.25 * 0.5 + 0.75 * 2 + energy.EPS), rtol=1e-12)


def test_equal_patches_cost_nothing_and_no_scale_is_zero():
    flat = np.full((6, 6, 3), 0.4)
    every = energy.SeamEnergy(
        "semantic",
        2.0,
        energy.make_colour_layer(flat),
        semantics.describe_segments(np.zeros((6, 6), int), flat, None, {}),
    )
    for share in (0.0, 0.5, 1.0):
        for cost in energy.compute_edge_costs(every.terms(share), where(0, 0), where(2, 1)):
            assert (cost == 0).all()


@given(seed=st.integers(0, 2**32 - 1), share=SHARES, place=st.tuples(*[st.integers(0, 8)] * 4))
@settings(max_examples=60)
def test_weights_are_symmetric_finite_not_negative_and_0_for_the_same_patch(seed, share, place):
    terms, (x, y, u, v) = noise_exemplar(seed).terms(share), place
    there, back = (
        energy.compute_edge_costs(terms, *p) for p in ((where(x, y), where(u, v)), (where(u, v), where(x, y)))
    )
    for a, b in zip(there, back, strict=True):
        np.testing.assert_array_equal(a, b)
        assert np.isfinite(a).all() and (a >= 0).all()
    for same in energy.compute_edge_costs(terms, where(x, y), where(x, y)):
        assert (same == 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_gamma_1_ignores_semantics_and_gamma_0_ignores_colour(seed):
    one, other = noise_exemplar(seed), noise_exemplar(seed + 1)
    mixed = energy.SeamEnergy("semantic", 2.0, one.colours, other.semantics)
    pair = where(0, 0, 6, 6), where(5, 3, 6, 6)
    for share, like, unlike in ((1.0, one, other), (0.0, other, one)):
        found, same, another = (energy.compute_edge_costs(e.terms(share), *pair)[0] for e in (mixed, like, unlike))
        np.testing.assert_array_equal(found, same)
        assert (found != another).any()


def test_energy_colour_is_gamma_1_whatever_the_uncertainty():
    colour = energy.SeamEnergy("colour", 2.0, noise_exemplar(1).colours, None)
    assert colour.gamma(0.9) == 1 and colour.terms(1.0) == [(1.0, colour.colours)]


@pytest.mark.parametrize("kind", ["semantic", "none"])
def test_the_surer_a_patch_the_more_its_colours_count(kind):
    e = noise_exemplar(1, kind)
    assert e.gamma(0.5) == 0.5 and e.gamma(0.0) == pytest.approx(0.7310585786)  # 1 / (1 + exp(-1))
    assert e.gamma(0.0) + e.gamma(1.0) == pytest.approx(1)
    assert noise_exemplar(1, "semantic-nogamma").gamma(0.0) == 0.5


@pytest.mark.parametrize("kind", energy.KINDS)
def test_gamma_of_what_is_not_a_number_is_refused(kind):
    with pytest.raises(ValueError, match="not a number"):
        noise_exemplar(1, kind).gamma(float("nan"))


def test_weights_do_not_depend_on_the_unit_of_colour():
    values = np.random.default_rng(1).random((9, 9, 3))
    pair = where(0, 0), where(4, 3)
    small, large = (energy.compute_edge_costs([(1.0, energy.make_colour_layer(k * values))], *pair) for k in (1, 9))
    for a, b in zip(small, large, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_weights_in_single_precision_agree_with_double(share):
    wide = noise_exemplar(4)
    narrow = energy.SeamEnergy(
        "semantic", 2.0, energy.make_colour_layer(wide.colours.values.astype(np.float32)), wide.semantics
    )
    pair = where(0, 0), where(6, 5)
    for a, b in zip(
        energy.compute_edge_costs(wide.terms(share), *pair),
        energy.compute_edge_costs(narrow.terms(share), *pair),
        strict=True,
    ):
        # colours up to 1 rounded to 2^-24, differences of them from 0.05 on, scales a sum over 144 cells
        np.testing.assert_allclose(a, b, rtol=2e-5)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.731, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_the_cut_of_a_small_grid_is_as_cheap_as_the_best_of_all_partitions(seed, share):
    right, upper = energy.compute_edge_costs(noise_exemplar(seed).terms(share), where(0, 0), where(6, 7))
    first, second = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    first[:, 0], second[:, -1] = True, True
    found = cuts.find_cut(right, upper, first, second)
    # capacities are rounded to 2^-32 of the largest: 24 edges lose at most 24 halves of that
    limit = 24 * 2.0**-32 * max(right.max(), upper.max())
    assert found.energy == pytest.approx(cheapest(right, upper, first, second), abs=limit)
    assert found.flow == found.cost
