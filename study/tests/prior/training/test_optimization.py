import numpy as np
import pytest
import torch

from dav_gswt.prior import weights
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import LATENT, PLANES, SIZE, Network
from dav_gswt_study.prior.training import example_files, optimization
from dav_gswt_study.prior.training.example_files import Examples
from dav_gswt_study.prior.training.optimization import EncodedExamples, TrainingPlan


def network():
    torch.manual_seed(3)
    return Network()


def test_the_coder_learns_and_its_codes_get_unit_variance(tmp_path):
    small = torch.rand((24, PLANES, 4, 4), generator=torch.Generator().manual_seed(0))
    pictures = (255 * torch.nn.functional.interpolate(small, (SIZE, SIZE), mode="bilinear")).to(torch.uint8)
    made = network()
    losses = optimization.train_autoencoder(made, pictures, TrainingPlan(12, 4, 3e-3, 0), tmp_path / "coder")
    assert len(losses) == 12 and sum(losses[-3:]) < sum(losses[:3])
    with torch.inference_mode():
        assert made.encode(pictures.float() / 255).std() == pytest.approx(1, rel=0.05)


def test_a_training_that_was_killed_ends_with_the_same_weights(tmp_path, monkeypatch):
    monkeypatch.setattr(optimization, "CHECKPOINT_STEPS", 2)
    truth = torch.randn((16, *LATENT), generator=torch.Generator().manual_seed(1))
    known = torch.ones((16, 1, *LATENT[1:]))
    codes = EncodedExamples(truth, truth + 0.1, known, truth.flip(0), torch.zeros((16, 4)))
    plan, whole = TrainingPlan(4, 2, 1e-3, 7), network()
    expected = optimization.train_denoiser(whole, codes, plan, tmp_path / "a")
    killed, turns = network(), iter(range(3))
    true = killed.predict_velocity

    def denoised(*given):
        if next(turns, None) is None:
            raise KeyboardInterrupt
        return true(*given)

    monkeypatch.setattr(killed, "predict_velocity", denoised)
    with pytest.raises(KeyboardInterrupt):
        optimization.train_denoiser(killed, codes, plan, tmp_path / "b")
    again = network()
    assert optimization.train_denoiser(again, codes, plan, tmp_path / "b") == pytest.approx(expected, rel=1e-6)
    for name, value in whole.state_dict().items():
        torch.testing.assert_close(again.state_dict()[name], value, msg=name)
    assert not list(tmp_path.iterdir())


def part(path, seed):
    rng = np.random.default_rng(seed)

    def drawn(*shape):
        return rng.uniform(0, 1, (6, *shape)).astype(np.float32)

    s = (SIZE, SIZE)
    known = Condition(drawn(*s, 3), drawn(*s), 3 * drawn(*s), drawn(*s, 3), drawn(4))
    example_files.write_examples(path, Examples(known, drawn(*s, 4), drawn(*s)))
    return path


def test_examples_become_weights_and_a_trained_coder_is_not_trained_again(tmp_path, monkeypatch):
    parts = [part(tmp_path / f"{i}.npz", i) for i in range(2)]
    plans = TrainingPlan(1, 2, 1e-3, 0), TrainingPlan(2, 2, 1e-3, 1)

    def train(name):
        return optimization.train_prior(parts, tmp_path / f"{name}.safetensors", plans, tmp_path / name)

    losses = train("whole")
    assert [len(losses[name]) for name in ("coder", "denoiser")] == [1, 2]
    with monkeypatch.context() as patch, pytest.raises(TypeError):
        patch.setattr(optimization, "train_denoiser", None)
        train("killed")
    assert train("killed") == losses
    assert (tmp_path / "whole.safetensors").read_bytes() == (tmp_path / "killed.safetensors").read_bytes()
    assert weights.load_weights(network(), tmp_path / "whole.safetensors") == {"examples": "12"}
