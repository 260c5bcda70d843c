"""The project's own prior, with weights that learned nothing: what it promises holds whatever they are."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from dav_gswt.errors import InputError
from dav_gswt.prior import weights
from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.prior.networks import LATENT, SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior, pack_render


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    torch.manual_seed(5)
    path = tmp_path_factory.mktemp("weights") / "terrain.safetensors"
    weights.save_weights(Network(), path, {"steps": "0"})
    return path


@pytest.fixture(scope="module")
def prior(file):
    return TerrainPrior.open(file)


def condition(count=3, seed=0):
    rng = np.random.default_rng(seed)

    def drawn(*shape):
        return rng.uniform(0, 1, (count, *shape)).astype(np.float32)

    pixels = (SIZE, SIZE)
    return Condition(drawn(*pixels, 3), drawn(*pixels), drawn(*pixels), drawn(*pixels, 3), drawn(4))


def test_it_is_a_prior_and_tells_what_its_file_says(prior, file):
    assert isinstance(prior, Prior) and prior.facts == {"steps": "0"}
    assert file.stat().st_size < 16 * 2**20


def test_no_dropout_gives_equal_samples_and_dropout_others(prior):
    still = prior.sample(condition(), 3, 0.0, 2, 0)
    assert still.shape == (3, 3, *LATENT) and np.ptp(still, axis=1).max() == 0
    assert (prior.sample(condition(), 3, 0.3, 2, 0).var(axis=1).mean((1, 2, 3)) > 0).all()


def test_a_latent_stands_for_as_much_as_the_coder_says(prior):
    latents = prior.sample(condition(), 2, 0.3, 2, 0)
    found = prior.estimate_variances(latents)
    assert found.shape == latents.shape and (found > 0).all()
    with torch.inference_mode():
        pictures = prior.network.decode(torch.from_numpy(latents[1]))
        expected = prior.network.posterior(pictures).std * prior.network.scale
    np.testing.assert_allclose(np.sqrt(found[1]), expected.numpy(), rtol=1e-4)


def test_what_the_field_shows_is_the_code_of_its_render(prior):
    given = condition()
    shown = prior.encode_render(given)
    assert shown.shape == (3, *LATENT)
    np.testing.assert_array_equal(shown, prior.encode(pack_render(given)).numpy())
    other = replace(given, photo=given.photo[::-1].copy(), relative=given.relative[::-1].copy())
    np.testing.assert_array_equal(prior.encode_render(other), shown)


def test_a_view_does_not_depend_on_the_others(prior):
    all_of_them, alone = prior.sample(condition(), 2, 0.2, 2, 0), prior.sample(condition()[1:2], 2, 0.2, 2, 0)
    np.testing.assert_allclose(all_of_them[1], alone[0], atol=1e-5)


def test_without_valid_pixels_the_render_has_no_influence(prior):
    one, two = condition(), replace(condition(seed=1), photo=condition().photo, relative=condition().relative)
    nothing = np.zeros((3, *LATENT[1:]), bool)
    found = [prior.sample(c, 1, 0.0, 2, 0, known=nothing) for c in (one, two)]
    np.testing.assert_allclose(*found, atol=1e-5)
    assert not np.allclose(prior.sample(one, 1, 0.0, 2, 0), prior.sample(two, 1, 0.0, 2, 0))


def test_pictures_of_latents_are_pictures(prior):
    made = prior.decode(np.random.default_rng(0).normal(size=(2, 3, *LATENT)).astype(np.float32))
    assert made.rgba.shape == (2, 3, SIZE, SIZE, 4) and made.inverse_depth.shape == (2, 3, SIZE, SIZE)
    assert made.rgba.min() >= 0 and made.rgba.max() <= 1


def test_a_condition_that_is_not_finite_is_refused_by_name(prior):
    bad = condition()
    bad.alpha[2, 0, 0] = np.nan
    with pytest.raises(ValueError, match="alpha of view 2"):
        prior.sample(bad, 2, 0.1, 2, 0)


@pytest.mark.parametrize("damage", ["short", "pickle", "missing", "shape", "nan", "extra", "gone"])
def test_damaged_weights_are_refused_by_name(file, tmp_path, damage):
    path = tmp_path / "weights.safetensors"
    network = Network()
    values = network.state_dict()
    if damage == "short":
        path.write_bytes(file.read_bytes()[:-1000])
    elif damage == "pickle":
        torch.save(values, path)
    elif damage != "gone":
        name, value = "told.place", values["condition_encoder.place"]
        change = {
            "missing": {},
            "shape": {name: value[:5]},
            "nan": {name: value * torch.nan},
            "extra": {name: value, "another": torch.zeros(1)},
        }[damage]
        stored = load_file(file)
        kept = {k: v for k, v in stored.items() if k != name} | change
        save_file({k: v.contiguous() for k, v in kept.items()}, str(path))
    with pytest.raises(InputError, match="weights.safetensors"):
        TerrainPrior.open(path)
