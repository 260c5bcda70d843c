"""The evaluation of the prior: its measures by hand-worked values, the table with untrained networks."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dav_gswt.images import lpips, lpips_weights
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import LATENT, SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.study.prior import evaluation
from dav_gswt.study.prior.evaluation import COLUMNS, Estimate, Setting
from dav_gswt.study.prior.training.example_files import Examples

OFF = np.float32([0.125, 0.25, 0.375, 0.5])
TINY = Setting(m=2, p_drop=0.15, steps=2)


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


@pytest.fixture(scope="module", autouse=True)
def few_steps():
    """Two numbers of steps instead of four: the networks here have not learned anything that more would show."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluation, "STEPS", (2, 4))
        yield


@pytest.fixture(scope="module")
def prior():
    torch.manual_seed(7)
    return TerrainPrior(Network())


@pytest.fixture(scope="module")
def random_weights():
    rng = np.random.default_rng(0)
    drawn = [rng.normal(0, (2 / np.prod(s[1:])) ** 0.5, s).astype(np.float32) for s in lpips_weights.KERNELS]
    biases = [np.zeros(len(k), np.float32) for k in drawn]
    return lpips_weights.Weights(tuple(drawn), tuple(biases), tuple(b + np.float32(0.1) for b in biases))


@pytest.fixture(scope="module")
def rows(prior, random_weights):
    return evaluation.evaluate_prior(made(3), prior, TINY, random_weights)


def found(rows, what):
    return [row for row in rows if row["what"] == what]


def of_cells(cells, views):
    """The columns of one map of uncertainty, made in no time."""
    truth = evaluation.compute_truth(views)
    return evaluation.summarize_scores(
        evaluation.score_estimate(Estimate("", "", 0.0, cells=np.float32(cells)), truth, None), truth
    )


def test_the_error_of_views_and_cells_is_worked_out_over_opaque_pixels():
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


def test_a_view_without_anything_opaque_is_refused_and_passed_over():
    views = made(4)
    views.rgba[1, ..., 3] = 0.9
    with pytest.raises(ValueError, match="view 1"):
        evaluation.compute_truth(views)
    np.testing.assert_array_equal(evaluation.select_evenly(views, 2).rgba, views.rgba[[0, 3]])
    np.testing.assert_array_equal(evaluation.select_evenly(views, 9).rgba, views.rgba[[0, 2, 3]])


def test_an_uncertainty_that_is_the_error_ranks_perfectly_and_its_opposite_does_not():
    error = np.arange(1, 5)[:, None, None] * np.ones((4, *LATENT[1:]))
    right, wrong = of_cells(error, made()), of_cells(-error, made())
    for by in ("", "ground_", "cell_"):
        assert right[f"{by}spearman"] == pytest.approx(1) and right[f"{by}ause"] == pytest.approx(0, abs=1e-9)
        assert wrong[f"{by}spearman"] == pytest.approx(-1) and wrong[f"{by}ause"] > 0.2
    blind = of_cells(np.ones_like(error), made())
    assert blind["spearman"] is None and blind["ause"] > 0.1 and blind["psnr"] is None


def test_uncertainty_of_the_sky_counts_for_the_picture_but_not_for_the_ground():
    views = made()
    views.rgba[:, :32, :, 3] = 0.0  # and the less of it is wrong below, the more is uncertain above
    uncertainty = np.zeros((4, *LATENT[1:]))
    uncertainty[:, 8:] = np.arange(1, 5)[:, None, None]
    uncertainty[:, :8] = 10 * np.arange(4, 0, -1)[:, None, None]
    row = of_cells(uncertainty, views)
    assert row["spearman"] == pytest.approx(-1)
    assert row["ground_spearman"] == pytest.approx(1) and row["cell_spearman"] == pytest.approx(1)


def test_covered_cells_are_those_that_the_render_covers():
    views = made()
    views.condition.alpha[:] = 1.0
    views.condition.alpha[:, :32] = 0.5
    uncertainty = np.arange(1, 5)[:, None, None] * np.ones((4, *LATENT[1:]))
    uncertainty[:, :8] = 5 - uncertainty[:, :8]
    row = of_cells(uncertainty, views)
    assert row["covered_spearman"] == pytest.approx(1) and abs(row["cell_spearman"]) < 0.1
    views.condition.alpha[:] = 0.5
    assert of_cells(uncertainty, views)["covered_spearman"] is None


def test_nearness_does_not_look_at_the_sky(random_weights):
    views = made()
    views.rgba[:, :32, :, 3] = 0.0
    picture = views.condition.colour.copy()
    truth = evaluation.compute_truth(views)
    one = evaluation.score_estimate(Estimate("", "", 0.0, picture=picture), truth, random_weights)
    np.testing.assert_allclose(one["psnr"], -20 * np.log10(OFF), atol=1e-4)
    picture[:, :32] = 1 - picture[:, :32]
    two = evaluation.score_estimate(Estimate("", "", 0.0, picture=picture), truth, random_weights)
    np.testing.assert_array_equal(one["psnr"], two["psnr"])
    np.testing.assert_array_equal(one["lpips"], two["lpips"])
    picture[:, 32:] = 1 - picture[:, 32:]
    assert (
        evaluation.score_estimate(Estimate("", "", 0.0, picture=picture), truth, random_weights)["lpips"]
        != one["lpips"]
    ).all()


def test_a_picture_that_is_the_truth_has_no_psnr():
    views = made(2)
    truth = evaluation.compute_truth(views)
    row = evaluation.summarize_scores(
        evaluation.score_estimate(Estimate("", "", 1.0, picture=truth.colour), truth, None), truth
    )
    assert row["psnr"] is None and row["lpips"] is None and row["seconds"] == 0.5


def test_every_method_has_its_rows_and_every_row_all_columns(rows):
    assert all(list(row) == ["what", "setting", *COLUMNS] for row in rows)
    assert len({(row["what"], row["setting"]) for row in rows}) == len(rows)
    count = {what: len(found(rows, what)) for what in dict.fromkeys(row["what"] for row in rows)}
    assert count == {
        "render": 1,
        "opacity": 1,
        "coder": 1,
        "sample": 2,
        "mean of samples": 2,
        "spread": 1,
        "residual of samples": 1,
        "w2_sq": 6,  # five shares at 2 steps, one more number of steps
        "gradient": 1,
        "lpips": 1,
    }
    for row in rows:
        assert (row["psnr"] is None) == (row["lpips"] is None) == (row["ause"] is not None)
        assert (row["cell_ause"] is None) == (row["ause"] is None or row["what"] == "lpips")
        assert (row["seconds"] > 0) == (row["what"] not in ("render", "opacity"))


def test_the_field_as_it_is_has_the_values_worked_by_hand(rows):
    """Off by OFF, and less opaque by as much."""
    (render,), (opacity,) = found(rows, "render"), found(rows, "opacity")
    assert render["psnr"] == pytest.approx(np.mean(-20 * np.log10(OFF[:3])), abs=1e-4)
    for by in ("", "ground_", "cell_"):
        assert opacity[f"{by}spearman"] == pytest.approx(1) and opacity[f"{by}ause"] == pytest.approx(0, abs=1e-9)


def test_pictures_in_the_table_are_those_of_the_networks(rows, prior, random_weights):
    views = made(3)
    truth = views.rgba[..., :3]
    single = prior.decode(prior.sample(views.condition, 1, 0.0, 4, 0)).rgba[:, 0, ..., :3]
    noises = prior.decode(prior.sample(views.condition, 2, 0.0, 2, 0, common=False)).rgba[..., :3]
    expected = {
        ("sample", "steps=4"): single,
        ("mean of samples", "m=2 noises steps=2"): noises.mean(1),
    }
    for (what, how), picture in expected.items():
        (row,) = [r for r in found(rows, what) if r["setting"] == how]
        squares = ((picture - truth).astype(float) ** 2).mean((1, 2, 3))
        assert row["psnr"] == pytest.approx(np.mean(-10 * np.log10(squares)), abs=1e-4)
        apart = lpips.distance(2 * picture - 1, 2 * truth - 1, random_weights)
        assert row["lpips"] == pytest.approx(apart.mean(), rel=1e-4)


def test_without_lpips_weights_their_row_and_column_are_absent(prior):
    rows = evaluation.evaluate_prior(made(2), prior, setting=TINY)
    assert all(row["lpips"] is None for row in rows)
    assert "lpips" not in {row["what"] for row in rows}


def test_the_batch_size_does_not_change_the_scores(rows, prior, random_weights, monkeypatch):
    monkeypatch.setattr(evaluation, "BATCH", 2)
    for one, two in zip(rows, evaluation.evaluate_prior(made(3), prior, TINY, random_weights), strict=True):
        assert one["what"] == two["what"] and one["setting"] == two["setting"]
        for name in ("psnr", "lpips", "ause"):
            assert (one[name] is None) == (two[name] is None)
            assert one[name] is None or one[name] == pytest.approx(two[name], rel=1e-3, abs=1e-4)


def test_a_residual_is_0_where_the_render_is_what_is_predicted(prior):
    views = made(2)
    code = prior.encode(evaluation.pack_render(views.condition)).numpy()
    assert evaluation.compute_residual(prior, views, code).max() == 0
    code[1, 2, 5, 6] += 2
    apart = evaluation.compute_residual(prior, views, code)
    assert apart[1, 5, 6] == pytest.approx(4 / LATENT[0], rel=1e-5) and np.count_nonzero(apart) == 1


def test_an_evaluation_without_views_is_refused(prior):
    with pytest.raises(ValueError, match="no view"):
        evaluation.evaluate_prior(made(2)[:0], prior)
    with pytest.raises(ValueError, match="at least 2 samples"):
        evaluation.evaluate_prior(made(2), prior, setting=replace(TINY, m=1))
