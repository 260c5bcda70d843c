import pytest
import torch

from dav_gswt.prior.networks import LATENT, PLANES, SIZE, Network
from dav_gswt_study.prior.training import optimization
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
