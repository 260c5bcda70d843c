from dataclasses import fields

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.prior.interface import Condition
from dav_gswt_study.prior.training import example_files, examples

SEED, COUNT = 4, 2


@pytest.fixture(scope="module")
def made():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(examples, "STEPS", (20, 25))
        patch.setattr(examples, "PHOTO_SIZES", (96, 112))
        yield examples.make_examples(SEED, COUNT)


@pytest.fixture
def stored(tmp_path, made):
    path = tmp_path / "part0.npz"
    example_files.write_examples(path, made)
    return path


def same(a, b) -> bool:
    arrays = [[getattr(e.condition, f.name) for f in fields(Condition)] + [e.rgba, e.inverse_depth] for e in (a, b)]
    return all(x.shape == y.shape and x.tobytes() == y.tobytes() for x, y in zip(*arrays, strict=True))


def test_a_seed_makes_the_same_examples_of_what_a_prior_takes_and_the_fit_resembles_the_truth(made):
    assert same(made, examples.make_examples(SEED, COUNT))
    made.condition.check()
    assert len(made) == len(made.condition) == COUNT
    for image in (made.condition.colour, made.condition.alpha, made.condition.photo, made.rgba):
        assert image.min() >= 0 and image.max() <= 1
    assert (made.condition.inverse_depth >= 0).all() and np.isfinite(made.inverse_depth).all()
    assert (made.rgba[..., 3].mean((1, 2)) >= examples.LEAST_COVER).all()
    both = (made.condition.alpha > 0.95) & (made.rgba[..., 3] > 0.95)
    apart = np.abs(made.condition.colour - made.rgba[..., :3])[both]
    assert both.mean() > 0.2
    assert 0.001 < apart.mean() < 0.15  # neither the truth itself nor another place


def test_stored_examples_come_back_to_the_bytes_precision(stored, tmp_path, made):
    again = example_files.read_examples(stored)
    np.testing.assert_allclose(again.rgba, made.rgba, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(again.condition.colour, made.condition.colour, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(again.inverse_depth, made.inverse_depth, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(again.condition.relative, made.condition.relative, rtol=1e-3, atol=1e-4)
    assert stored.stat().st_size < 100_000 * COUNT
    example_files.write_examples(tmp_path / "again.npz", made)
    assert stored.read_bytes() == (tmp_path / "again.npz").read_bytes()


def test_half_a_file_is_refused(stored):
    stored.write_bytes(stored.read_bytes()[: stored.stat().st_size // 2])
    with pytest.raises(InputError, match="not readable as examples"):
        example_files.read_examples(stored)
