"""Seam weights by hand, and cuts against all partitions of small grids."""

from itertools import product

import numpy as np
import pytest

from dav_gswt.tiles import cuts
from dav_gswt.tiles.cuts import Scales

UNIT = Scales(1.0, 1.0)


def weights(a, b, unit=UNIT):
    return cuts.weights(a, b, cuts.gradients(a), cuts.gradients(b), unit)


def cheapest(right, upper, first, second):
    """Slow twin of cuts.cut: every labelling of the free cells."""
    free = np.argwhere(~(first | second))
    best = np.inf
    for bits in product([False, True], repeat=len(free)):
        labels = second.copy()
        labels[tuple(free.T)] = bits
        cost = right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum()
        best = min(best, cost)
    return best


def test_weight_of_two_flat_patches_is_their_difference_over_eps():
    # d = 0.1 at both cells, no gradient: D / (0 + EPS) = 0.2 / 0.1
    right, upper = weights(np.full((2, 2, 1), 0.5), np.full((2, 2, 1), 0.6))
    np.testing.assert_allclose(right, 0.2 / cuts.EPS, rtol=1e-12)
    np.testing.assert_allclose(upper, 0.2 / cuts.EPS, rtol=1e-12)


def test_a_gradient_across_an_edge_makes_only_that_edge_cheaper():
    ramp = np.broadcast_to(np.arange(3.0)[None, :, None], (3, 3, 1))
    right, upper = weights(ramp, ramp + 0.1)
    # four gradients of 1 along x, none along y
    np.testing.assert_allclose(right, 0.2 / (4 + cuts.EPS), rtol=1e-12)
    np.testing.assert_allclose(upper, 0.2 / cuts.EPS, rtol=1e-12)


def test_equal_patches_cost_nothing_and_no_scale_is_zero():
    flat = np.full((3, 3, 3), 0.4)
    right, upper = weights(flat, flat, cuts.scales(flat))
    assert (right == 0).all() and (upper == 0).all()


def test_weights_are_symmetric_finite_and_not_negative():
    rng = np.random.default_rng(0)
    a, b = rng.random((2, 5, 6, 3))
    unit = cuts.scales(a)
    for there, back in zip(weights(a, b, unit), weights(b, a, unit), strict=True):
        np.testing.assert_array_equal(there, back)
        assert np.isfinite(there).all() and (there >= 0).all()


def test_weights_do_not_depend_on_the_unit_of_colour():
    a, b = np.random.default_rng(1).random((2, 5, 5, 3))
    both = np.concatenate([a, b])
    for small, large in zip(
        weights(a, b, cuts.scales(both)), weights(9 * a, 9 * b, cuts.scales(9 * both)), strict=True
    ):
        np.testing.assert_allclose(small, large, rtol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_cut_of_a_small_grid_is_as_cheap_as_the_best_of_all_partitions(seed):
    rng = np.random.default_rng(seed)
    right, upper = rng.random((4, 3)), rng.random((3, 4))
    first, second = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    first[:, 0], second[:, -1] = True, True
    if seed % 2:  # forced cells of any shape
        first[:, 0], first[1, 1], second[2, 1] = rng.random(4) < 0.5, True, True
    found = cuts.cut(right, upper, first, second)
    # capacities are rounded to 2^-32 of the largest: 24 edges lose at most 24 halves of that
    assert found.energy == pytest.approx(cheapest(right, upper, first, second), abs=24 * 2.0**-32)
    assert found.flow == found.cost
    assert not found.labels[first].any() and found.labels[second].all()


def test_cut_runs_where_the_cost_is_low():
    right, upper = np.ones((3, 4)), np.full((2, 5), 0.1)
    right[[0, 1, 2], [1, 2, 1]] = 0.01
    first, second = np.zeros((3, 5), bool), np.zeros((3, 5), bool)
    first[:, 0], second[:, -1] = True, True
    found = cuts.cut(right, upper, first, second)
    np.testing.assert_array_equal(found.labels, [[0, 0, 1, 1, 1], [0, 0, 0, 1, 1], [0, 0, 1, 1, 1]])
    assert found.energy == pytest.approx(3 * 0.01 + 2 * 0.1, abs=1e-8)


def test_cut_without_free_cells_costs_its_forced_border():
    forced = np.array([[True, False]])
    found = cuts.cut(np.array([[0.7]]), np.zeros((0, 2)), forced, ~forced)
    assert found.energy == pytest.approx(0.7) and found.flow == found.cost


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_cut_refuses_costs_that_mean_nothing(bad):
    none = np.zeros((1, 2), bool)
    with pytest.raises(ValueError, match="finite"):
        cuts.cut(np.array([[bad]]), np.zeros((0, 2)), none, none)


def test_cut_refuses_a_cell_that_is_forced_both_ways():
    every = np.ones((2, 2), bool)
    with pytest.raises(ValueError, match="both"):
        cuts.cut(np.ones((2, 1)), np.ones((1, 2)), every, every)
