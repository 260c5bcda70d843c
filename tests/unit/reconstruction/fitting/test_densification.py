"""When a fit grows and prunes, where Gaussians are added and moved, and what their sizes are clipped to."""

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


def test_the_ground_is_never_moved_and_what_grows_on_it_is_small_and_flat_beside_it():
    now, errors = some(opacity=0.001), np.ones(20, np.float32)
    before = {name: value.copy() for name, value in now.values.items()}
    now.values["opacity_logits"][:] = 3.0
    densification.grow(now, 20, np.zeros(20, bool), errors, 30, np.random.default_rng(0))
    assert len(now) == 30
    for name in ("means", "log_scales", "colours"):
        np.testing.assert_array_equal(now.values[name][:20], before[name])
    np.testing.assert_allclose(np.exp(now.values["log_scales"][20:]), [[0.1, 0.1, 0.2]] * 10, rtol=1e-5)


def test_only_the_nearly_transparent_are_shaken_and_steps_along_a_gaussians_axes_turn_with_it():
    now = some()
    now.values["opacity_logits"][:10] = -9
    before = now.values["means"].copy()
    densification.perturb(now.values, 0, 0.5, np.random.default_rng(0))
    moved = np.linalg.norm(now.values["means"] - before, axis=1)
    assert moved[:10].min() > 0 and moved[10:].max() == 0
    assert moved.max() < 5 * 0.5 * 0.2
    now.values["quats"][0] = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]  # x to y
    step = densification.rotate_steps(now.values, np.array([0]), np.array([[1.0, 0, 0]]))
    np.testing.assert_allclose(step, [[0, 0.2, 0]], atol=1e-6)


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
