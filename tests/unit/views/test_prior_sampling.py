"""Two stages of scoring: what is scored in full, what it saves, and that the best are still the best."""

import logging
from dataclasses import replace

import numpy as np
import torch
from fixtures import lpips_arrays

from dav_gswt.prior.interface import Condition, DecodedViews
from dav_gswt.prior.networks import SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.views import prior_sampling, terms
from dav_gswt.views.prior_sampling import BATCH, TOP, PriorConfig

N = 100
NAMES = [f"p{i}" for i in range(N)]
ALL = np.ones((N, 32, 32), np.float32)  # every pixel counts


def terms_of(w2, lpips=None):
    maps = np.broadcast_to(w2[:, None, None], (len(w2), 2, 2)).astype(np.float32)
    return {"w2_sq": w2, "gradient": w2 / 2, "maps": maps} | ({} if lpips is None else {"lpips": lpips})


def pick(found, rows):
    return {name: values[rows] for name, values in found.items()}


def made(noise=0.1, seed=0):
    """Full terms, and cheap ones at a third of their level and a little off."""
    rng = np.random.default_rng(seed)
    values = np.exp(rng.normal(size=(2, 400)))
    return terms_of(*values), terms_of(*(values * np.exp(noise * rng.normal(size=(2, 400))) / 3))


def run(full, cheap):
    asked = []

    def fully(rows):
        asked.append(rows)
        return pick(full, rows)

    found, done = prior_sampling.score_in_stages(len(full["w2_sq"]), lambda rows: pick(cheap, rows), fully)
    assert sorted(np.concatenate(asked)) == list(np.flatnonzero(done))  # none twice
    return found, done


def best(values, k=TOP):
    return set(np.argsort(-values, kind="stable")[:k])


def test_the_best_are_found_for_less_unless_cheap_scores_say_nothing():
    full, cheap = made()
    found, done = run(full, cheap)
    assert done.sum() < 0.5 * len(done)
    for name in ("w2_sq", "lpips"):
        assert len(best(found[name]) & best(full[name])) >= 0.9 * TOP
    found, done = run(full, made(seed=99)[1])
    assert done.mean() > 0.9 and np.array_equal(found["w2_sq"][done], full["w2_sq"][done])


def test_those_left_cheap_are_brought_to_the_level_of_the_others_maps_too_and_zeros_settle_at_once():
    full, cheap = made(noise=0.0)
    found, done = run(full, cheap)
    assert not done.all()
    for name in ("w2_sq", "lpips", "gradient"):
        np.testing.assert_allclose(found[name], full[name], rtol=1e-12)
    np.testing.assert_allclose(found["maps"][:, 0, 0], full["w2_sq"], rtol=1e-6)
    zero = terms_of(np.zeros(100))
    found, done = run(zero, zero)
    assert done.sum() == TOP + prior_sampling.STAGE and not found["w2_sq"].any()


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

    def decode(self, latents):
        return DecodedViews(np.full((*latents.shape[:2], 32, 32, 4), 0.5, np.float32), None)


def condition(n):
    blank = np.zeros((n, 32, 32, 3), np.float32)
    order = np.random.default_rng(0).permutation(n)
    relative = np.repeat(order[:, None], 4, 1).astype(np.float32)
    return Condition(blank, blank[..., 0], blank[..., 0], blank, relative)


def sampled(config, n=N, masks=ALL):
    return prior_sampling.sample_terms(config, condition(n), NAMES[:n], masks[:n])


def test_sampling_in_stages_costs_less_and_says_how_much_and_few_poses_are_sampled_in_full_at_once(caplog, monkeypatch):
    whole, staged, few, n = Counting(), Counting(), Counting(), prior_sampling.FEW
    with caplog.at_level(logging.INFO):
        some, spent = sampled(PriorConfig(staged, 2, 8, 0.1))
        monkeypatch.setattr(prior_sampling, "FEW", N)
        full, steps = sampled(PriorConfig(whole, 2, 8, 0.1))
        monkeypatch.undo()
    assert whole.evaluations == N * 2 * 8 and (steps == 8).all()
    assert staged.evaluations == N * 2 * 2 + (spent == 8).sum() * 2 * 8 < 0.7 * whole.evaluations
    assert "of 100 poses were sampled in full" in caplog.text
    assert best(full["w2_sq"]) == best(some["w2_sq"])
    _, steps = sampled(PriorConfig(few, 2, 8, 0.1), n)
    assert few.evaluations == n * 2 * 8 and (steps == 8).all()


def test_what_does_not_look_at_the_ground_does_not_count():
    maps = np.arange(8, dtype=np.float32).reshape(2, 2, 2)
    counts = np.zeros((2, 4, 4), np.float32)
    counts[0, :2, :2] = counts[0, 3, 3] = 1  # a whole cell, and a quarter of another
    np.testing.assert_allclose(terms.weighted_mean(maps, counts), [(0 * 1 + 3 * 0.25) / 1.25, 0])


def test_without_dropout_the_one_sample_is_compared_with_the_render():
    alone = PriorConfig(Counting(), 2, 2, 0.0, weights=lpips_arrays.random())
    assert (sampled(alone, 3)[0]["single"] > 0).all()  # grey is not the black that the render shows
    assert not sampled(alone, 3, 0 * ALL)[0]["single"].any()
    assert "single" not in sampled(replace(alone, p_drop=0.1), 3)[0]


def test_terms_do_not_depend_on_the_number_of_threads_which_pytorch_keeps(monkeypatch):
    torch.manual_seed(3)
    prior, rng, count = TerrainPrior(Network()), np.random.default_rng(1), BATCH + 1  # one whole batch and a rest
    planes = [rng.uniform(0, 1, (count, SIZE, SIZE)).astype(np.float32) for _ in range(2)]
    colour, photo = (rng.uniform(0, 1, (count, SIZE, SIZE, 3)).astype(np.float32) for _ in range(2))
    seen = Condition(colour, *planes, photo, rng.uniform(-1, 1, (count, 4)).astype(np.float32))
    config = PriorConfig(prior, 2, 2, 0.2, weights=lpips_arrays.random())
    before, found = torch.get_num_threads(), []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        masks = np.ones((count, SIZE, SIZE), np.float32)
        found.append(prior_sampling.sample_terms(config, seen, NAMES[:count], masks)[0])
        assert torch.get_num_threads() == before
    for name in ("w2_sq", "lpips", "gradient", "maps", "residual"):
        np.testing.assert_array_equal(*(each[name] for each in found), err_msg=name)
