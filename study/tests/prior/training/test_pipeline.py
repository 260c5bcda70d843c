import numpy as np
import pytest

from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import SIZE
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt_study.prior.training import example_files, optimization, pipeline
from dav_gswt_study.prior.training.example_files import Examples
from dav_gswt_study.prior.training.optimization import TrainingPlan


def part(path, seed):
    rng = np.random.default_rng(seed)

    def drawn(*shape):
        return rng.uniform(0, 1, (6, *shape)).astype(np.float32)

    s = (SIZE, SIZE)
    known = Condition(drawn(*s, 3), drawn(*s), 3 * drawn(*s), drawn(*s, 3), drawn(4))
    example_files.write_examples(path, Examples(known, drawn(*s, 4), drawn(*s)))
    return path


def test_examples_become_weights_and_an_interrupted_training_resumes(tmp_path, monkeypatch):
    parts = [part(tmp_path / f"{i}.npz", i) for i in range(2)]
    plans = TrainingPlan(1, 2, 1e-3, 0), TrainingPlan(2, 2, 1e-3, 1)

    def train(name):
        return pipeline.train_prior(parts, tmp_path / f"{name}.safetensors", plans, tmp_path / name)

    def stop(*_):
        raise KeyboardInterrupt

    losses = train("whole")
    assert len(losses.autoencoder) == 1 and len(losses.denoiser) == 2
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(optimization, "train_denoiser", stop)
        train("killed")
    assert train("killed") == losses  # the autoencoder was not trained again
    one, two = (TerrainPrior.open(tmp_path / f"{name}.safetensors") for name in ("whole", "killed"))
    for (name, a), b in zip(one.network.state_dict().items(), two.network.state_dict().values(), strict=True):
        np.testing.assert_array_equal(a.numpy(), b.numpy(), name)
    assert one.facts == {"examples": "12"}


def test_pictures_are_stored_as_bytes_and_near_depths_are_clipped(tmp_path):
    pictures = pipeline.load_pictures([part(tmp_path / "0.npz", 0)])
    made = example_files.read_examples(tmp_path / "0.npz")
    assert len(pictures) == 6 and pictures.truth.shape == (6, 5, SIZE, SIZE)
    expected = np.clip(0.5 * made.condition.inverse_depth, 0, 1)
    np.testing.assert_allclose(pictures.render[:, 4].numpy() / 255, expected, atol=0.5 / 255 + 1e-6)
    assert (pictures.photo[:, 3] == 255).all() and (pictures.photo[:, 4] == 0).all()
