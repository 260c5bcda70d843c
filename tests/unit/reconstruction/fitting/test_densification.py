"""When a fit grows and prunes, and where Gaussians are added and moved."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.reconstruction.fitting import densification, state
from dav_gswt.reconstruction.fitting.plan import GROWTH_END, FitPlan, Schedule
from dav_gswt.reconstruction.objects import make_blobs


def some(n=20, opacity=0.8, size=0.2):
    rng = np.random.default_rng(0)
    logit = float(np.log(opacity / (1 - opacity)))
    return state.from_field(make_blobs(rng.uniform(-1, 1, (n, 3)), rng.uniform(0, 1, (n, 3)), np.full(n, size), logit))


@pytest.mark.parametrize("parts", [1, 2, 8])
def test_copies_together_look_as_the_one_before(parts):
    """Over a line through the middle: the integral of 1 - (1 - o' g)^N is that of o g (Kheradmand et al., Eq. 9)."""
    each, size = densification.split_opacity(np.array([0.7]), np.array([parts]))
    t = np.linspace(-12, 12, 20001)
    one = np.trapezoid(0.7 * np.exp(-(t**2) / 2), t)
    many = np.trapezoid(1 - (1 - each[0] * np.exp(-((t / size[0]) ** 2) / 2)) ** parts, t)
    assert many == pytest.approx(one, rel=1e-6)
    assert 1 - (1 - each[0]) ** parts == pytest.approx(0.7, rel=1e-9)
    now = some(1, opacity=0.7)
    densification.grow(now, 0, np.zeros(1, bool), np.ones(1), parts, np.random.default_rng(0))
    assert len(now) == parts and len(np.unique(now.values["means"], axis=0)) == parts
    np.testing.assert_allclose(densification.to_opacity(now.values["opacity_logits"]), each[0], rtol=1e-5)
    np.testing.assert_allclose(np.exp(now.values["log_scales"]), 0.2 * size[0], rtol=1e-5)
    assert np.linalg.norm(np.ptp(now.values["means"], axis=0)) < 5 * 0.2  # half their size apart


def test_the_dead_go_where_the_errors_are_and_the_cap_holds():
    now, errors = some(), np.zeros(20, np.float32)
    assert densification.grow(now, 0, np.zeros(20, bool), errors, 40, np.random.default_rng(0)) == 0
    now.values["opacity_logits"][:5] = -9
    errors[12] = 1.0
    place = now.values["means"][12].copy()
    moved = densification.grow(now, 0, np.zeros(20, bool), errors, 23, np.random.default_rng(0))
    assert moved == 8 and len(now) == 23  # five dead, three new
    away = np.linalg.norm(now.values["means"] - place, axis=1)
    assert (away[[*range(5), 20, 21, 22]] < 1.0).all()
    assert densification.to_opacity(now.values["opacity_logits"]).min() > 0.05


def grown(plan, start):
    """Steps at which a fit grows, and how many Gaussians it ends with."""
    schedule, now, at = Schedule(plan, start), start, []
    for step in range(1, plan.steps + 1):
        if schedule.to_growth(step) == 0:
            at.append(step)
            now = schedule.max_gaussians(step, now)
    return at, now


@settings(max_examples=40)
@given(st.integers(1, 600), st.integers(1, 10**6), st.integers(1, 10**6))
def test_a_fit_reaches_its_cap_by_the_end_of_its_growth_and_never_exceeds_it(steps, start, cap):
    at, now = grown(FitPlan(steps, cap), start)
    assert now == max(start, cap) or (now == start and not at)
    assert all(step <= GROWTH_END * steps for step in at)
