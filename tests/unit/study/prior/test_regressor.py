"""The regressor, with weights that learned nothing: it is asked as it is trained, and distinguished from the prior."""

import numpy as np
import pytest
import torch

from dav_gswt.errors import InputError
from dav_gswt.prior import weights
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import LATENT, SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior, average_opacity, pack_photo, pack_render
from dav_gswt.study.prior.regressor import Regressor


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    torch.manual_seed(6)
    folder = tmp_path_factory.mktemp("weights")
    weights.save_weights(Network(), folder / "prior.safetensors", {"regressor": "False"})
    weights.save_weights(Network(), folder / "regressor.safetensors", {"regressor": "True"})
    return folder


@pytest.fixture(scope="module")
def regressor(files):
    return Regressor.open(files / "regressor.safetensors")


@pytest.fixture(scope="module")
def condition():
    rng = np.random.default_rng(0)
    s = (SIZE, SIZE)
    shapes = (3, *s, 3), (3, *s), (3, *s), (3, *s, 3), (3, 4)
    return Condition(*(rng.uniform(0, 1, shape).astype(np.float32) for shape in shapes))


def test_it_predicts_what_training_compares_with_the_code(regressor, condition):
    """The network asked as `training.train_denoiser` asks it: no noise, time 0, all of the render valid."""
    network = regressor.network
    with torch.inference_mode():
        render, photo = (network.encode(p) for p in (pack_render(condition), pack_photo(condition.photo)))
        opacity = average_opacity(torch.from_numpy(condition.alpha))
        tokens = network.condition_encoder(photo, torch.from_numpy(condition.relative))
        zero, time = torch.zeros(3, *LATENT), torch.zeros(3, dtype=torch.long)
        expected = network.predict_velocity(
            zero, time, render, torch.cat([opacity, torch.ones_like(opacity)], 1), tokens
        )
    np.testing.assert_allclose(regressor.predict(condition), expected.numpy(), atol=1e-5)


def test_without_dropout_all_are_the_prediction_to_the_bit_and_with_dropout_they_differ(regressor, condition):
    still = regressor.sample(condition, 3, 0.0, 0)
    assert still.shape == (3, 3, *LATENT) and np.ptp(still, axis=1).max() == 0
    np.testing.assert_array_equal(still[:, 0], regressor.predict(condition))
    dropped = regressor.sample(condition, 3, 0.3, 0)
    assert (dropped.var(axis=1).mean((1, 2, 3)) > 0).all()
    np.testing.assert_array_equal(dropped, regressor.sample(condition, 3, 0.3, 0))
    assert not np.allclose(dropped, regressor.sample(condition, 3, 0.3, 1))


def test_a_view_does_not_depend_on_the_others(regressor, condition):
    alone = regressor.sample(condition[1:2], 2, 0.2, 0)
    np.testing.assert_allclose(regressor.sample(condition, 2, 0.2, 0)[1], alone[0], atol=1e-5)


def test_its_codes_decode_to_pictures(regressor, condition):
    made = regressor.decode(regressor.predict(condition))
    assert made.rgba.shape == (3, SIZE, SIZE, 4) and made.rgba.min() >= 0 and made.rgba.max() <= 1


def test_the_prior_and_a_regressor_are_not_taken_for_each_other(files):
    with pytest.raises(InputError, match="prior.safetensors: not the weights of a regressor but of the prior"):
        Regressor.open(files / "prior.safetensors")
    with pytest.raises(InputError, match="regressor.safetensors: not the weights of the prior but of a regressor"):
        TerrainPrior.open(files / "regressor.safetensors")


@pytest.mark.parametrize("m, p_drop", [(0, 0.1), (0, 0.0), (2, 1.0), (2, -0.1)])
def test_what_makes_no_sense_is_refused_by_name(regressor, condition, m, p_drop):
    with pytest.raises(ValueError, match="m is 0|p_drop is"):
        regressor.sample(condition, m, p_drop, 0)


def test_a_condition_that_is_not_finite_is_refused_by_name(regressor, condition):
    bad = condition[:]
    bad = Condition(bad.colour, bad.alpha.copy(), bad.inverse_depth, bad.photo, bad.relative)
    bad.alpha[2, 0, 0] = np.nan
    with pytest.raises(ValueError, match="alpha of view 2"):
        regressor.predict(bad)
