"""Cuts against all partitions of small grids."""

import numpy as np
import pytest
from fixtures.seams import cheapest

from dav_gswt.tiles import cuts


@pytest.mark.parametrize("seed", range(6))
def test_cut_of_a_small_grid_is_as_cheap_as_the_best_of_all_partitions(seed):
    rng = np.random.default_rng(seed)
    right, upper = rng.random((4, 3)), rng.random((3, 4))
    first, second = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    first[:, 0], second[:, -1] = True, True
    if seed % 2:  # forced cells of any shape
        first[:, 0], first[1, 1], second[2, 1] = rng.random(4) < 0.5, True, True
    found = cuts.find_cut(right, upper, first, second)
    # capacities are rounded to 2^-32 of the largest: 24 edges lose at most 24 halves of that
    assert found.energy == pytest.approx(cheapest(right, upper, first, second), abs=24 * 2.0**-32)
    assert found.flow == found.cost
    assert not found.labels[first].any() and found.labels[second].all()


def test_cut_runs_where_the_cost_is_low():
    right, upper = np.ones((3, 4)), np.full((2, 5), 0.1)
    right[[0, 1, 2], [1, 2, 1]] = 0.01
    first, second = np.zeros((3, 5), bool), np.zeros((3, 5), bool)
    first[:, 0], second[:, -1] = True, True
    found = cuts.find_cut(right, upper, first, second)
    np.testing.assert_array_equal(found.labels, [[0, 0, 1, 1, 1], [0, 0, 0, 1, 1], [0, 0, 1, 1, 1]])
    assert found.energy == pytest.approx(3 * 0.01 + 2 * 0.1, abs=1e-8)


def test_cut_without_free_cells_costs_its_forced_border():
    forced = np.array([[True, False]])
    found = cuts.find_cut(np.array([[0.7]]), np.zeros((0, 2)), forced, ~forced)
    assert found.energy == pytest.approx(0.7) and found.flow == found.cost


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_cut_refuses_costs_that_mean_nothing(bad):
    none = np.zeros((1, 2), bool)
    with pytest.raises(ValueError, match="finite"):
        cuts.find_cut(np.array([[bad]]), np.zeros((0, 2)), none, none)


def test_cut_refuses_a_cell_that_is_forced_both_ways():
    every = np.ones((2, 2), bool)
    with pytest.raises(ValueError, match="both"):
        cuts.find_cut(np.ones((2, 1)), np.ones((1, 2)), every, every)


@pytest.mark.parametrize("value", [0.0, 0.3])
@pytest.mark.parametrize("forced", [0, 1])
def test_where_only_one_patch_is_forced_all_is_that_patch_and_there_is_no_seam(value, forced):
    sides = [np.zeros((3, 4), bool), np.zeros((3, 4), bool)]
    sides[forced][0] = True
    found = cuts.find_cut(np.full((3, 3), value), np.full((2, 4), value), *sides)
    # where nothing costs anything, free cells may show either
    assert found.energy == 0 and (value == 0 or (found.labels == bool(forced)).all())


def test_a_straight_seam_costs_what_it_crosses_and_no_less_than_the_cut():
    rng = np.random.default_rng(3)
    right, upper = rng.random((5, 5)), rng.random((4, 6))
    half = np.arange(6) >= 3
    labels = np.broadcast_to(half, (5, 6))
    straight = cuts.price_cut(right, upper, labels)
    assert straight.energy == pytest.approx(right[:, 2].sum(), abs=5 * 2.0**-32)
    first, second = np.zeros((5, 6), bool), np.zeros((5, 6), bool)
    first[:, 0], second[:, -1] = True, True
    assert cuts.find_cut(right, upper, first, second).energy < straight.energy
    with pytest.raises(ValueError, match="finite"):
        cuts.price_cut(np.full((5, 5), np.nan), upper, labels)
