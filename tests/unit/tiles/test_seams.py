"""Seams: their costs, cheapest cuts against all partitions of small grids, and what stands on the ground."""

import numpy as np
import pytest
from fixtures.seams import cheapest
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.tiles import energy, semantics

SHARES = st.sampled_from([0.0, 0.25, 0.5, 0.731, 1.0])


def where(x, y, h=4, w=4):
    rows, columns = np.mgrid[y : y + h, x : x + w]
    return rows, columns


def noise_exemplar(seed, kind="semantic", side=12):
    """An exemplar of noise, in segments of 3 x 3 cells."""
    rng = np.random.default_rng(seed)
    colour = rng.random((side, side, 3))
    segments = np.kron(np.arange((side // 3) ** 2).reshape(side // 3, -1), np.ones((3, 3), int))
    layers = energy.make_colour_layer(colour), semantics.describe_segments(segments, colour, None)
    return energy.SeamEnergy(kind, 2.0, *layers)


@given(seed=st.integers(0, 2**32 - 1), share=SHARES, place=st.tuples(*[st.integers(0, 8)] * 4))
@settings(max_examples=20)
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


def test_gamma_1_ignores_semantics_and_gamma_0_ignores_colour():
    one, other = noise_exemplar(0), noise_exemplar(1)
    mixed = energy.SeamEnergy("semantic", 2.0, one.colours, other.semantics)
    pair = where(0, 0, 6, 6), where(5, 3, 6, 6)
    for share, like, unlike in ((1.0, one, other), (0.0, other, one)):
        found, same, another = (energy.compute_edge_costs(e.terms(share), *pair)[0] for e in (mixed, like, unlike))
        np.testing.assert_array_equal(found, same)
        assert (found != another).any()


@pytest.mark.parametrize("seed", range(4))
def test_cut_of_a_small_grid_is_as_cheap_as_the_best_of_all_partitions(seed):
    rng = np.random.default_rng(seed)
    right, upper = rng.random((4, 3)), rng.random((3, 4))
    first, second = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    first[:, 0], second[:, -1] = True, True
    if seed % 2:  # forced cells of any shape
        first[:, 0], first[1, 1], second[2, 1] = rng.random(4) < 0.5, True, True
    found = energy.find_cut(right, upper, first, second)
    # capacities are rounded to 2^-32 of the largest: 24 edges lose at most 24 halves of that
    assert found.energy == pytest.approx(cheapest(right, upper, first, second), abs=24 * 2.0**-32)
    assert not found.labels[first].any() and found.labels[second].all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_costs_that_mean_nothing_and_cells_forced_both_ways_are_refused(bad):
    costs, none, every = (np.array([[bad]]), np.zeros((0, 2))), np.zeros((1, 2), bool), np.ones((2, 2), bool)
    with pytest.raises(ValueError, match="finite"):
        energy.find_cut(*costs, none, none)
    with pytest.raises(ValueError, match="both"):
        energy.find_cut(np.ones((2, 1)), np.ones((1, 2)), every, every)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_parting_a_thing_costs_what_it_hides_whatever_gamma_is(share):
    cover = np.zeros((2, 4))
    cover[:, 1] = 0.75
    flat = energy.make_colour_layer(np.full((2, 4, 3), 0.5))
    priced = energy.SeamEnergy("semantic", 2.0, flat, flat, energy.make_occluder_layer(cover))
    rows, columns = np.mgrid[:2, :2]
    right, upper = energy.compute_edge_costs(priced.terms(share), (rows, columns), (rows, columns + 2))
    # of the four things in an edge's two cells one hides .75, and two do along the second column
    np.testing.assert_allclose(right, energy.OCCLUDER_WEIGHT * 0.75 / energy.EPS)
    np.testing.assert_allclose(upper, np.array([[0, energy.OCCLUDER_WEIGHT * 1.5]]) / energy.EPS)
    same = energy.compute_edge_costs(priced.terms(share), (rows, columns), (rows, columns))
    assert not any(w.any() for w in same)  # a shrub that goes on in both patches is not parted
