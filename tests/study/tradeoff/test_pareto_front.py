"""The front: worked by hand, ties, one point, and a twin that compares every pair."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.study.tradeoff.front import find_pareto_front, find_rivals

few = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12)  # ties are common


def split(points):
    cost, worth = np.array(points, float).T
    return cost, worth


def by_pairs(points):
    def beaten(i):
        return any(
            c <= points[i][0] and w >= points[i][1] and (c, w) != tuple(points[i]) for c, w in points
        )  # no more and no less, and not the same: one of the two strictly

    return [not beaten(i) for i in range(len(points))]


@pytest.mark.parametrize(
    "points, on",
    [
        pytest.param([(1, 1)], [1], id="one point"),
        pytest.param([(1, 1), (2, 2), (3, 3)], [1, 1, 1], id="all worth their cost"),
        pytest.param([(1, 3), (2, 2), (3, 1)], [1, 0, 0], id="one beats all"),
        pytest.param([(1, 1), (1, 1)], [1, 1], id="equal points share it"),
        pytest.param([(1, 1), (1, 2)], [0, 1], id="as cheap and better"),
        pytest.param([(2, 2), (1, 2)], [0, 1], id="as good and cheaper"),
    ],
)
def test_points_that_nothing_beats(points, on):
    assert find_pareto_front(*split(points)).tolist() == [bool(x) for x in on]


@given(few)
def test_the_front_is_that_of_all_pairs(points):
    assert find_pareto_front(*split(points)).tolist() == by_pairs(points)


@given(few)
def test_a_rival_is_affordable_and_the_best_there_is(points):
    cost, worth = split(points)
    for i, rival in enumerate(find_rivals(cost, worth)):
        assert cost[rival] <= cost[i]
        assert worth[rival] == max(w for c, w in points if c <= cost[i])
        assert rival == i or worth[rival] > worth[i]


def test_what_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match="not a number"):
        find_pareto_front(np.array([1.0, np.nan]), np.array([1.0, 2.0]))
    assert find_pareto_front(np.zeros(0), np.zeros(0)).size == 0
