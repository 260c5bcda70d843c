import numpy as np
import torch

from dav_gswt.images import image_files
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import LATENT, SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.study.prior import plots
from dav_gswt.study.prior.evaluation import Setting
from dav_gswt.study.prior.training.example_files import Examples


def test_colours_stand_over_grey_where_nothing_is():
    rgba = np.float32([[0.2, 0.4, 0.6, 1.0], [0, 0, 0, 0]]).reshape(2, 1, 1, 4)
    found = plots.composite_over_grey(rgba).reshape(2, 3)
    np.testing.assert_allclose(found, [[0.2, 0.4, 0.6], [plots.GREY] * 3], atol=1e-6)


def test_a_gallery_shows_what_was_given_what_is_true_and_what_was_guessed(tmp_path):
    rng = np.random.default_rng(0)
    s = (2, SIZE, SIZE)
    shapes = (*s, 3), s, s, (*s, 3), (2, 4), (*s, 4), s
    drawn = [rng.uniform(0, 1, shape).astype(np.float32) for shape in shapes]
    drawn[5][..., 3] = drawn[5][..., 3] > 0.5
    torch.manual_seed(0)
    prior = TerrainPrior(Network())
    columns = plots.make_gallery(Examples(Condition(*drawn[:5]), *drawn[5:]), prior, Setting(m=4, steps=1))
    assert list(columns)[:3] == ["photo given", "render given", "truth"]
    assert list(columns)[3:7] == ["sample 1", "sample 2", "sample 3", "mean of 4"]
    assert all(values.shape == (*s, 3) for values in list(columns.values())[:7])
    assert not np.allclose(columns["sample 1"], columns["sample 2"])
    error, uncertainty = columns["error of render"], columns["uncertainty (w2_sq)"]
    np.testing.assert_array_equal(np.isnan(error), drawn[5][..., 3] == 0)
    assert uncertainty.shape == (2, *LATENT[1:]) and uncertainty.min() > 0
    plots.plot_samples(columns, tmp_path / "a.png")
    picture = image_files.read_photo(tmp_path / "a.png")
    assert picture.shape[1] > 1.4 * SIZE * len(columns)  # no picture is shown smaller than it is
    assert picture.std() > 0.05
