"""Two stages of scoring: what is scored in full, what it saves, and that the best are still the best."""

import logging

import numpy as np
import pytest
from fixtures import lpips_arrays

from dav_gswt.prior.interface import Condition, DecodedViews
from dav_gswt.views import prior_sampling
from dav_gswt.views.prior_sampling import PriorConfig
from dav_gswt.views.uncertainty import staging
from dav_gswt.views.uncertainty.staging import TOP, PriorTerms

ALL = np.ones((200, 32, 32), np.float32)  # every pixel counts


def terms_of(w2, lpips=None):
    maps = np.broadcast_to(w2[:, None, None], (len(w2), 2, 2)).astype(np.float32)
    return PriorTerms(w2, lpips, w2 / 2, maps)


def pick(terms, rows):
    return PriorTerms(*(None if v is None else v[rows] for v in vars(terms).values()))


def made(n=400, noise=0.1, seed=0, lpips=True):
    """Full terms, and cheap ones at a third of their level and a little off."""
    rng = np.random.default_rng(seed)
    w2, lp = np.exp(rng.normal(size=(2, n)))
    off = np.exp(noise * rng.normal(size=(2, n))) / 3
    return terms_of(w2, lp if lpips else None), terms_of(w2 * off[0], lp * off[1] if lpips else None)


def run(full, cheap):
    asked = []

    def fully(rows):
        asked.append(rows)
        return pick(full, rows)

    found, done = staging.score_in_stages(len(full.w2_sq), lambda rows: pick(cheap, rows), fully)
    assert sorted(np.concatenate(asked)) == list(np.flatnonzero(done))  # none twice
    return found, done


def best(values, k=TOP):
    return set(np.argsort(-values, kind="stable")[:k])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("lpips", [True, False])
def test_the_best_are_found_for_less(seed, lpips):
    full, cheap = made(seed=seed, lpips=lpips)
    found, done = run(full, cheap)
    assert done.sum() < 0.5 * len(done)
    assert len(best(found.w2_sq) & best(full.w2_sq)) >= 0.9 * TOP
    if lpips:
        assert len(best(found.lpips) & best(full.lpips)) >= 0.9 * TOP


def test_where_cheap_scores_say_nothing_nearly_all_are_scored_in_full():
    full, _ = made()
    _, noise = made(seed=99)
    found, done = run(full, noise)
    assert done.mean() > 0.9 and np.array_equal(found.w2_sq[done], full.w2_sq[done])


def test_those_left_cheap_are_brought_to_the_level_of_the_others_maps_too():
    full, cheap = made(noise=0.0)
    found, done = run(full, cheap)
    assert not done.all()
    np.testing.assert_allclose(found.w2_sq, full.w2_sq, rtol=1e-12)
    np.testing.assert_allclose(found.maps[:, 0, 0], full.w2_sq, rtol=1e-6)


def test_scores_that_are_all_zero_settle_at_once():
    zero = terms_of(np.zeros(100))
    found, done = run(zero, zero)
    assert done.sum() == TOP + staging.BATCH and not found.w2_sq.any()


class Counting:
    """Doubts view i by i; counts the network evaluations that it would have made."""

    name, size = "counting", 32

    def __init__(self):
        self.evaluations = 0

    def sample(self, condition, m, p_drop, steps, seed, common=True):
        self.evaluations += len(condition) * m * steps
        signs = np.where(np.arange(m) % 2, -1.0, 1.0)[None, :, None, None, None]
        size = condition.relative[:, 0, None, None, None, None] * (1 + 0.01 * steps)
        return (size * signs * np.ones((1, m, 4, 32, 32))).astype(np.float32)

    def encode_render(self, condition):
        return np.zeros((len(condition), 4, 32, 32), np.float32)

    def estimate_variances(self, latents):
        return np.zeros_like(latents)

    def decode(self, latents):
        return DecodedViews(np.full((*latents.shape[:2], 32, 32, 4), 0.5, np.float32), None)


def condition(n):
    blank = np.zeros((n, 32, 32, 3), np.float32)
    order = np.random.default_rng(0).permutation(n)
    relative = np.repeat(order[:, None], 4, 1).astype(np.float32)
    return Condition(blank, blank[..., 0], blank[..., 0], blank, relative)


def test_sampling_in_stages_costs_less_and_says_how_much(caplog):
    n, names = 200, [f"p{i}" for i in range(200)]
    with caplog.at_level(logging.INFO):
        whole, staged = Counting(), Counting()
        full, steps = prior_sampling.sample_terms(
            PriorConfig(whole, 4, 8, 0.1, staged=False), condition(n), names, ALL[:n]
        )
        some, spent = prior_sampling.sample_terms(PriorConfig(staged, 4, 8, 0.1), condition(n), names, ALL[:n])
    assert whole.evaluations == n * 4 * 8 and (steps == 8).all()
    assert staged.evaluations == n * 4 * 2 + (spent == 8).sum() * 4 * 8 < 0.6 * whole.evaluations
    assert "of 200 poses were sampled in full" in caplog.text
    assert best(full.w2_sq) == best(some.w2_sq)


def test_what_does_not_look_at_the_ground_does_not_count():
    maps = np.arange(8, dtype=np.float32).reshape(2, 2, 2)
    counts = np.zeros((2, 4, 4), np.float32)
    counts[0, :2, :2] = counts[0, 3, 3] = 1  # a whole cell, and a quarter of another
    np.testing.assert_allclose(prior_sampling.weighted_mean(maps, counts), [(0 * 1 + 3 * 0.25) / 1.25, 0])


def test_few_poses_are_scored_in_full_at_once():
    """So few that the first stage would cost more than it can save."""
    prior, n = Counting(), prior_sampling.FEW
    _, steps = prior_sampling.sample_terms(
        PriorConfig(prior, 2, 8, 0.1), condition(n), [f"p{i}" for i in range(n)], ALL[:n]
    )
    assert prior.evaluations == n * 2 * 8 and (steps == 8).all()


def test_without_dropout_the_one_sample_is_compared_with_the_render():
    prior, told = Counting(), condition(3)
    some = prior_sampling.sample_terms(
        PriorConfig(prior, 2, 2, 0.0, weights=lpips_arrays.random()), told, ["a", "b", "c"], ALL[:3]
    )[0]
    assert (some.single > 0).all()  # grey is not the black that the render shows
    hidden = prior_sampling.sample_terms(
        PriorConfig(prior, 2, 2, 0.0, weights=lpips_arrays.random()), told, ["a"] * 3, 0 * ALL[:3]
    )[0]
    assert not hidden.single.any()
    assert prior_sampling.sample_terms(PriorConfig(prior, 2, 2, 0.1), told, ["a", "b", "c"], ALL[:3])[0].single is None


def test_one_sample_has_no_pair():
    with pytest.raises(ValueError, match="at least 2 samples"):
        prior_sampling.sample_terms(PriorConfig(Counting(), 1, 8, 0.1), condition(3), ["a", "b", "c"], ALL[:3])
