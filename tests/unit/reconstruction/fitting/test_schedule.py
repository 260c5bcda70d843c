"""When a fit grows and prunes, and what it may grow to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.reconstruction.fitting.plan import MAX_GAUSSIANS, FitPlan
from dav_gswt.reconstruction.fitting.schedule import EVENTS, FINAL_RATE, GROWTH, GROWTH_END, PRUNE_AT, VISIBLE, Schedule


def grown(plan, start, error=0.0):
    """Steps at which a fit grows, and how many Gaussians it ends with."""
    schedule, now, at = Schedule(plan, start), start, []
    for step in range(1, plan.steps + 1):
        if schedule.to_growth(step) == 0:
            at.append(step)
            now = schedule.max_gaussians(step, now, error)
    return at, now


@given(st.integers(1, 5000), st.integers(1, 10**6), st.integers(1, 10**6))
def test_a_fit_reaches_its_cap_by_the_end_of_its_growth_and_never_exceeds_it(steps, start, cap):
    at, now = grown(FitPlan(steps, cap), start)
    assert now == max(start, cap) or (now == start and not at)
    assert all(step <= GROWTH_END * steps for step in at)


@given(st.integers(20, 5000))
def test_events_are_even_and_pruning_comes_after_them(steps):
    schedule = Schedule(FitPlan(steps, 100), 10)
    at, _ = grown(schedule.plan, 10)
    assert len(set(np.diff(at))) <= 1 and EVENTS <= len(at) <= 2 * EVENTS
    (pruned,) = (step for step in range(1, steps + 1) if schedule.prunes(step))
    assert at[-1] < pruned == int(PRUNE_AT * steps) < steps


@given(st.integers(1, 500), st.integers(1, 600))
def test_what_is_left_to_the_next_growth_counts_down_to_it(steps, step):
    schedule = Schedule(FitPlan(steps, 100), 10)
    ahead = schedule.to_growth(step)
    if ahead:
        assert schedule.to_growth(step + 1) == ahead - 1
    elif ahead is None:
        assert schedule.to_growth(step + 1) is None


def test_a_field_that_is_as_large_as_it_may_be_stays_as_it_is():
    assert grown(FitPlan(100, 50), 50) == ([], 50)
    assert not any(Schedule(FitPlan(100, 50), 50).prunes(step) for step in range(101))


def test_rates_fall_to_what_is_left_of_them():
    schedule = Schedule(FitPlan(80, 1), 1)
    rates = [schedule.rate(step) for step in range(81)]
    assert rates[0] == 1 and rates[-1] == pytest.approx(FINAL_RATE) and (np.diff(rates) < 0).all()
    assert Schedule(FitPlan(0, 1), 1).rate(0) == 1


def test_rates_begin_where_the_plan_says_and_end_as_in_any_fit():
    schedule = Schedule(FitPlan(80, 1, first_rate=0.3), 1)
    rates = [schedule.rate(step) for step in range(81)]
    assert rates[0] == pytest.approx(0.3) and rates[-1] == pytest.approx(FINAL_RATE) and (np.diff(rates) < 0).all()


@pytest.mark.parametrize("rate", [0.0, -0.1, 1.5, float("nan")])
def test_a_first_rate_that_is_no_share_is_refused(rate):
    with pytest.raises(ValueError, match="first_rate"):
        FitPlan(80, 1, first_rate=rate)


def test_without_a_number_visible_errors_say_how_many_and_growth_is_bounded():
    schedule, asked = Schedule(FitPlan(100, "auto"), 1000), 5000 * 1.01 * VISIBLE**2
    assert schedule.max_gaussians(7, 4900, asked) == 5050
    assert schedule.max_gaussians(7, 1000, asked) == 1000 * (1 + GROWTH)  # the first of ten
    assert schedule.max_gaussians(70, 1000, asked) == 1000 * (1 + GROWTH / EVENTS)  # the last
    assert schedule.max_gaussians(7, 6000, asked) == 6000  # none is taken away
    assert schedule.max_gaussians(7, 1000, 0.0) == 1000
    assert schedule.max_gaussians(7, MAX_GAUSSIANS - 10, 1e9) == MAX_GAUSSIANS
    assert Schedule(FitPlan(100, "auto", limit=1200), 1000).max_gaussians(7, 1000, asked) == 1200
