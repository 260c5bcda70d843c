import numpy as np
import pytest
import torch
from dav_gswt_study.prior.evaluation import Estimate, Setting
from fixtures import lpips_arrays

from dav_gswt.images import lpips
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import LATENT, SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt_study.prior import evaluation
from dav_gswt_study.prior.training.example_files import Examples

OFF = np.float32([0.125, 0.25, 0.375, 0.5])
TINY = Setting(m=2, p_drop=0.15, steps=2)
WEIGHTS = lpips_arrays.random()
RANKS = np.arange(1, 5)[:, None, None] * np.ones((4, *LATENT[1:]))  # of views, as OFF ranks them


def made(count=4, seed=0):
    """Views whose truth is opaque everywhere, and whose renders are off by OFF in every colour, to the bit."""
    rng = np.random.default_rng(seed)
    s = (SIZE, SIZE)
    truth = (rng.integers(0, 128, (count, *s, 3)) / 256).astype(np.float32)
    off = OFF[:count, None, None]
    photo, apart = rng.uniform(0, 1, truth.shape), rng.uniform(-1, 1, (count, 4))
    known = Condition(
        truth + off[..., None], 1 - off * np.ones(s, np.float32), *map(np.float32, (photo[..., 0], photo, apart))
    )
    return Examples(known, np.concatenate([truth, np.ones((count, *s, 1), np.float32)], -1), known.inverse_depth)


@pytest.fixture(scope="module")
def prior():
    torch.manual_seed(7)
    return TerrainPrior(Network())


@pytest.fixture(scope="module")
def rows(prior):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluation, "STEPS", (2, 4))
        return evaluation.evaluate_prior(made(3), prior, TINY, WEIGHTS)


def of_cells(cells, views):
    """The columns of one map of uncertainty, made in no time."""
    truth = evaluation.compute_truth(views)
    scores = evaluation.score_estimate(Estimate("", "", 0.0, cells=np.float32(cells)), truth, None)
    return evaluation.summarize_scores(scores, truth)


def test_the_error_is_worked_out_over_opaque_pixels_and_a_view_without_any_is_refused_and_passed_over():
    views = made(2)
    views.rgba[..., 3] = 0.5
    views.rgba[:, :4, :8, 3] = 1.0  # two cells; of the second, half
    views.rgba[:, :2, 4:8, 3] = 0.98
    views.condition.colour[:] = views.rgba[..., :3] + np.float32(0.3)
    views.condition.colour[:, :4, :4] = views.rgba[:, :4, :4, :3]
    truth = evaluation.compute_truth(views)
    np.testing.assert_allclose(truth.error, np.sqrt(8 * 0.09 / 24), rtol=1e-5)
    np.testing.assert_allclose(truth.cell_error[:, 0, :3], [[0, 0.3, 0]] * 2, atol=1e-6)
    np.testing.assert_array_equal(truth.share[:, 0, :3], [[1, 0.5, 0]] * 2)
    views = made(4)
    views.rgba[1, ..., 3] = 0.9
    with pytest.raises(ValueError, match="view 1"):
        evaluation.compute_truth(views)
    np.testing.assert_array_equal(evaluation.select_evenly(views, 2).rgba, views.rgba[[0, 3]])
    np.testing.assert_array_equal(evaluation.select_evenly(views, 9).rgba, views.rgba[[0, 2, 3]])


def test_an_uncertainty_that_is_the_error_ranks_perfectly_and_its_opposite_does_not():
    right, wrong = of_cells(RANKS, made()), of_cells(-RANKS, made())
    for by in ("", "ground_", "cell_"):
        assert right[f"{by}spearman"] == pytest.approx(1) and right[f"{by}ause"] == pytest.approx(0, abs=1e-9)
        assert wrong[f"{by}spearman"] == pytest.approx(-1) and wrong[f"{by}ause"] > 0.2
    blind = of_cells(np.ones_like(RANKS), made())
    assert blind["spearman"] is None and blind["ause"] > 0.1 and blind["psnr"] is None
    # uncertainty of the sky counts for the picture but not for the ground
    views, uncertainty = made(), RANKS.copy()
    views.rgba[:, :32, :, 3] = 0.0  # and the less of it is wrong below, the more is uncertain above
    uncertainty[:, :8] = 10 * RANKS[::-1, :8]
    row = of_cells(uncertainty, views)
    assert row["spearman"] == pytest.approx(-1)
    assert row["ground_spearman"] == pytest.approx(1) and row["cell_spearman"] == pytest.approx(1)


def test_nearness_does_not_look_at_the_sky():
    views = made()
    views.rgba[:, :32, :, 3] = 0.0
    truth = evaluation.compute_truth(views)

    def score(picture, seconds=0.0):
        return evaluation.score_estimate(Estimate("", "", seconds, picture=picture), truth, WEIGHTS)

    picture = views.condition.colour.copy()
    one = score(picture)
    np.testing.assert_allclose(one["psnr"], -20 * np.log10(OFF), atol=1e-4)
    picture[:, :32] = 1 - picture[:, :32]
    two = score(picture)
    np.testing.assert_array_equal([one["psnr"], one["lpips"]], [two["psnr"], two["lpips"]])
    picture[:, 32:] = 1 - picture[:, 32:]
    assert (score(picture)["lpips"] != one["lpips"]).all()
    exact = evaluation.summarize_scores(score(truth.colour, 2.0), truth)
    assert exact["psnr"] is None and exact["lpips"] == 0 and exact["seconds"] == 0.5


def test_pictures_in_the_table_are_those_of_the_field_and_of_the_networks(rows, prior):
    """The field is off by OFF, and less opaque by as much."""
    (render,), (opacity,) = ([row for row in rows if row["what"] == what] for what in ("render", "opacity"))
    assert render["psnr"] == pytest.approx(np.mean(-20 * np.log10(OFF[:3])), abs=1e-4)
    assert opacity["spearman"] == pytest.approx(1)
    views = made(3)
    truth = views.rgba[..., :3]
    single = prior.decode(prior.sample(views.condition, 1, 0.0, 4, 0)).rgba[:, 0, ..., :3]
    noises = prior.decode(prior.sample(views.condition, 2, 0.0, 2, 0, common=False)).rgba[..., :3].mean(1)
    for how, picture in (("steps=4", single), ("m=2 noises steps=2", noises)):
        (row,) = [row for row in rows if row["setting"] == how and row["psnr"] is not None]
        squares = ((picture - truth).astype(float) ** 2).mean((1, 2, 3))
        assert row["psnr"] == pytest.approx(np.mean(-10 * np.log10(squares)), abs=1e-4)
        apart = lpips.distance(2 * picture - 1, 2 * truth - 1, WEIGHTS)
        assert row["lpips"] == pytest.approx(apart.mean(), rel=1e-4)


def test_a_residual_is_0_where_the_render_is_what_is_predicted(prior):
    views = made(2)
    code = prior.encode(evaluation.pack_render(views.condition)).numpy()
    assert evaluation.compute_residual(prior, views, code).max() == 0
    code[1, 2, 5, 6] += 2
    apart = evaluation.compute_residual(prior, views, code)
    assert apart[1, 5, 6] == pytest.approx(4 / LATENT[0], rel=1e-5) and np.count_nonzero(apart) == 1
