"""Policies beside the greedy choice by true gain, from one pool."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings
from dav_gswt.study.views import gain_bound

COARSE = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=8)
UPDATE = UpdateSettings(size=48, max_gaussians=5000, steps_per_photo=2)
SETTINGS = gain_bound.BoundSettings(COARSE, UPDATE, k=2, rounds=2, weights=None)


@pytest.fixture(scope="module")
def pool():
    views, frame = made.photos(11), replace(made.FRAME, kind="synthetic")
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    return gain_bound.Pool(frame, views[:3], views[3:9], views[9:], *none, 0.15)


@pytest.fixture(scope="module")
def rows(pool):
    return gain_bound.compare_choices(pool, SETTINGS, [0])


def begin(pool, k=2):
    start = gain_bound.StartViews(pool.frame, pool.start, pool.points, pool.colours, pool.margin)
    first = gain_bound.fit_coarse_field(start, COARSE, np.random.default_rng(0))
    return gain_bound.State(pool, replace(SETTINGS, k=k), first, pool.start, pool.photos, (0, 1))


def test_every_policy_is_measured_after_every_round_from_the_same_first_fit(rows):
    assert rows[0]["policy"] is None and rows[0]["photos"] == 3
    cases = [(row["policy"], row["round"], row["photos"]) for row in rows[1:]]
    assert cases == [(policy, t, 3 + 2 * t) for policy in gain_bound.COMPARED for t in (1, 2)]


@pytest.mark.parametrize("policy", gain_bound.COMPARED)
def test_a_policy_takes_new_photos_of_the_pool(pool, policy):
    state = begin(pool)
    chosen = gain_bound.choose_by_gain(state) if policy == "gain" else gain_bound.choose_by_policy(policy, state)
    assert len({view.name for view in chosen}) == 2
    assert {view.name for view in chosen} <= {view.name for view in pool.photos}


def test_the_choice_by_gain_has_the_smallest_error_of_all_single_photos(pool):
    state = begin(pool, k=1)
    [chosen] = gain_bound.choose_by_gain(state)
    errors = {view.name: gain_bound.measure_error(state.refit([view]), pool.tests) for view in pool.photos}
    assert errors[chosen.name] == min(errors.values()) < max(errors.values())
