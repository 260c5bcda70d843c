"""Terms of the prior: the same bits whatever the number of threads."""

import numpy as np
import pytest
import torch
from fixtures import lpips_arrays

from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.views.prior_sampling import BATCH, PriorConfig, sample_terms

COUNT = BATCH + 5  # one whole batch and a rest


@pytest.fixture(scope="module")
def prior():
    torch.manual_seed(3)
    return TerrainPrior(Network())


@pytest.fixture(scope="module")
def condition():
    rng = np.random.default_rng(1)
    picture = (COUNT, SIZE, SIZE)
    planes = [rng.uniform(0, 1, picture).astype(np.float32) for _ in range(2)]
    colour, photo = (rng.uniform(0, 1, (*picture, 3)).astype(np.float32) for _ in range(2))
    return Condition(colour, *planes, photo, rng.uniform(-1, 1, (COUNT, 4)).astype(np.float32))


def terms(prior, condition, **more):
    config = PriorConfig(prior, 2, 2, 0.2, weights=lpips_arrays.random(), posterior=True, **more)
    names = [f"p{i}" for i in range(COUNT)]
    return sample_terms(config, condition, names, np.ones((COUNT, SIZE, SIZE), np.float32))[0]


def test_terms_do_not_depend_on_the_number_of_threads(prior, condition, monkeypatch):
    found = []
    for threads in ("1", "2", "3"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(terms(prior, condition))
    for other in found[1:]:
        for name in ("w2_sq", "lpips", "gradient", "maps", "residual"):
            np.testing.assert_array_equal(getattr(found[0], name), getattr(other, name), err_msg=name)


def test_pytorch_keeps_its_threads(prior, condition):
    before = torch.get_num_threads()
    terms(prior, condition)
    assert torch.get_num_threads() == before
