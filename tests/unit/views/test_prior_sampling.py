"""Terms that need samples of a prior."""

from dataclasses import replace

import numpy as np
import torch
from fixtures import lpips_arrays

from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.views import scoring, terms
from dav_gswt.views.scoring import BATCH, PriorConfig

N = 8
NAMES = [f"p{i}" for i in range(N)]
ALL = np.ones((N, 32, 32), np.float32)  # every pixel counts


class Grey:
    """Samples that differ in sign."""

    name, size, small = "grey", 32, False

    def sample(self, condition, m, p_drop, steps, seed, common=True):
        signs = np.where(np.arange(m) % 2, -1.0, 1.0)[None, :, None, None, None]
        return (signs * np.ones((len(condition), m, 4, 32, 32))).astype(np.float32)

    def decode(self, latents):
        return np.full((*latents.shape[:2], 32, 32, 4), 0.5, np.float32)


def condition(n):
    blank = np.zeros((n, 32, 32, 3), np.float32)
    return Condition(blank, blank[..., 0], blank[..., 0], blank, np.zeros((n, 4), np.float32))


def sampled(config, n=N, masks=ALL):
    return scoring.sample_terms(config, condition(n), NAMES[:n], masks[:n])


def test_what_does_not_look_at_the_ground_does_not_count():
    maps = np.arange(8, dtype=np.float32).reshape(2, 2, 2)
    counts = np.zeros((2, 4, 4), np.float32)
    counts[0, :2, :2] = counts[0, 3, 3] = 1  # a whole cell, and a quarter of another
    np.testing.assert_allclose(terms.weighted_mean(maps, counts), [(0 * 1 + 3 * 0.25) / 1.25, 0])


def test_without_dropout_the_one_sample_is_compared_with_the_render():
    alone = PriorConfig(Grey(), 2, 2, 0.0, weights=lpips_arrays.random())
    assert (sampled(alone, 3)["single"] > 0).all()  # grey is not the black that the render shows
    assert not sampled(alone, 3, 0 * ALL)["single"].any()
    assert "single" not in sampled(replace(alone, p_drop=0.1), 3)


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
        found.append(scoring.sample_terms(config, seen, NAMES[:count], masks))
        assert torch.get_num_threads() == before
    for name in ("w2_sq", "lpips", "gradient", "maps"):
        np.testing.assert_array_equal(*(each[name] for each in found), err_msg=name)
