"""Facility location against brute force, and what it must never do."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.views import facility_location


def places(n, seed=0):
    found = np.random.default_rng(seed).normal(size=(n, 3))
    return 2 * found / np.linalg.norm(found, axis=1, keepdims=True)


def value(at, taken, u, chosen):
    everyone = np.concatenate([taken, at[list(chosen)]])
    if not len(everyone):
        return 0.0
    return float(u @ facility_location.similarity(at, everyone, facility_location.kernel_width(at)).max(1))


@given(seed=st.integers(0, 200), n=st.integers(3, 12), k=st.integers(1, 4), m=st.integers(0, 3))
def test_greedy_is_within_its_bound_of_the_best(seed, n, k, m):
    rng = np.random.default_rng(seed)
    at, taken, u = places(n, seed), places(m, seed + 1), rng.uniform(0, 1, n)
    chosen = facility_location.select_facilities(at, taken, u, k)
    best = max(value(at, taken, u, some) for some in combinations(range(n), min(k, n)))
    start = value(at, taken, u, [])
    assert len(set(chosen)) == min(k, n)
    assert value(at, taken, u, chosen) - start >= (1 - 1 / np.e) * (best - start) - 1e-12


@given(seed=st.integers(0, 50))
def test_lazy_greedy_is_greedy(seed):
    at, taken, u = places(40, seed), places(3, seed + 1), np.random.default_rng(seed).uniform(0, 1, 40)
    near = facility_location.similarity(at, at, facility_location.kernel_width(at))
    covered, expected = facility_location.similarity(at, taken, facility_location.kernel_width(at)).max(1), []
    for _ in range(8):
        gain = facility_location.coverage_gains(near, covered, u)
        gain[expected] = -1
        expected.append(int(np.argmax(gain)))
        covered = np.maximum(covered, near[:, expected[-1]])
    assert facility_location.select_facilities(at, taken, u, 8) == expected


def test_a_duplicate_gains_nothing():
    at = np.concatenate([places(5), places(5)[:1]])
    near = facility_location.similarity(at, at, facility_location.kernel_width(at))
    gain = facility_location.coverage_gains(near, near[:, 0], np.ones(6))
    assert gain[5] == pytest.approx(0, abs=1e-12) and gain[1] > 0.01
    chosen = facility_location.select_facilities(at, np.zeros((0, 3)), np.ones(6), 6)
    assert chosen[-1] in (0, 5)  # the second of the two that coincide is worth nothing


def test_the_order_of_candidates_does_not_matter():
    at, taken, u = places(60), places(4, 1), np.random.default_rng(2).uniform(0, 1, 60)
    order = np.random.default_rng(3).permutation(60)
    one, two = (
        facility_location.select_facilities(at, taken, u, 10),
        facility_location.select_facilities(at[order], taken, u[order], 10),
    )
    assert one == [int(order[i]) for i in two]


def test_uncertain_candidates_are_chosen_unless_a_photo_is_nearby():
    at = np.array([[2.0, 0, 0], [1.9, 0.3, 0.0], [-2.0, 0, 0], [0, 2.0, 0]])
    assert facility_location.select_facilities(at, np.zeros((0, 3)), np.array([0.1, 0.1, 1, 0.1]), 1) == [2]
    assert facility_location.select_facilities(at, at[2:3], np.array([0.3, 0.3, 1, 0.1]), 1)[0] in (0, 1)


def test_without_uncertainty_candidates_are_chosen_by_index():
    assert facility_location.select_facilities(places(5), np.zeros((0, 3)), np.zeros(5), 3) == [0, 1, 2]


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf])
def test_a_weight_that_is_no_weight_is_refused(bad):
    with pytest.raises(ValueError, match="weight of a candidate"):
        facility_location.select_facilities(places(2), np.zeros((0, 3)), np.array([1.0, bad]), 1)
    with pytest.raises(ValueError, match="middle"):
        facility_location.select_facilities(np.zeros((2, 3)), np.zeros((0, 3)), np.ones(2), 1)
