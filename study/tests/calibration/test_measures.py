import json

import numpy as np
import pytest
from scipy.stats import spearmanr

from dav_gswt_study.calibration import agreement as measures


def test_a_score_that_knows_the_errors_and_one_that_knows_nothing():
    rng = np.random.default_rng(0)
    error = rng.exponential(1, 300)
    scores = {"oracle": error**2, "reversed": -error, "nothing": rng.normal(size=300)}
    found = measures.evaluate_scores(scores, error, seed=0)
    assert list(found) == ["oracle", "reversed", "nothing"]
    assert found["oracle"]["spearman"] == pytest.approx(1) and found["oracle"]["ause"] == pytest.approx(0, abs=1e-12)
    assert found["reversed"]["spearman"] == pytest.approx(-1) and abs(found["nothing"]["spearman"]) < 0.15
    # leaving out at random changes nothing: about chance, by as much as 300 poses scatter
    assert found["nothing"]["ause"] == pytest.approx(found["nothing"]["ause_chance"], abs=0.1)
    assert found["reversed"]["ause"] > found["reversed"]["ause_chance"] > 0.3
    for one in found.values():
        # the mean over splits is 0.9 or, by the rank, up to 1 / 76 more; 200 splits scatter by 0.003
        assert one["coverage"] == pytest.approx(0.907, abs=0.02)
    assert found["oracle"]["width"] < 0.5 * found["nothing"]["width"]


def test_nothing_is_said_of_too_few_poses_or_a_constant_and_what_is_not_a_number_is_refused():
    ranked = {"spearman", "ause", "ause_chance"}
    for count, said in ((7, set()), (8, ranked), (33, ranked), (34, ranked | {"coverage", "width"})):
        error = np.random.default_rng(2).exponential(1, count)
        (found,) = measures.evaluate_scores({"a": np.arange(count, dtype=float)}, error, 0).values()
        assert len(found) == 5 and {key for key, value in found.items() if value is not None} == said
    error = np.arange(50.0)
    found = measures.evaluate_scores({"a": np.ones(50), "b": error}, error, 0)
    assert set(found["a"].values()) == {None} and None not in found["b"].values()
    with pytest.raises(ValueError, match="not finite"):
        measures.evaluate_scores({"a": np.where(error == 3, np.nan, error)}, error, 0)


def test_cells_are_means_over_the_middle_square_of_what_is_known():
    picture = np.arange(24.0).reshape(4, 6)  # the middle square: columns 1 to 4
    np.testing.assert_allclose(measures.average_cells(picture, 2, 2), [[4.5, 6.5], [16.5, 18.5]])
    np.testing.assert_allclose(measures.average_cells(picture.T, 2, 2), [[4.5, 16.5], [6.5, 18.5]])
    picture[0, 1] = picture[0, 2] = np.nan  # half of the first cell is left: 7 and 8
    picture[2:, 3] = picture[3, 4] = np.nan  # a quarter of the last
    np.testing.assert_allclose(measures.average_cells(picture, 2, 2), [[7.5, 6.5], [16.5, np.nan]])
    thirds = measures.average_cells(np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]]), 2, 2)
    # the first cell: 1 whole, halves of 2 and 4, a quarter of 5
    assert thirds[0, 0] == pytest.approx((1 + 0.5 * (2 + 4) + 0.25 * 5) / 2.25)


def test_pixels_are_compared_where_the_error_is_known(monkeypatch):
    rng = np.random.default_rng(3)
    score, error = rng.uniform(size=(2, 5, 12, 16))
    error = error + score
    error[:, :, 12:] = np.nan
    found = measures.evaluate_pixels({"a": score, "oracle": error.copy(), "flat": np.ones((5, 12, 16))}, error)
    known = np.isfinite(error)
    assert found["a"]["pixel_spearman"] == pytest.approx(spearmanr(score[known], error[known]).statistic)
    with monkeypatch.context() as patch:  # of many some are taken evenly
        patch.setattr(measures, "PIXELS", 720 // 2)
        some = spearmanr(score[known][::2], error[known][::2]).statistic
        assert measures.evaluate_pixels({"a": score}, error)["a"]["pixel_spearman"] == pytest.approx(some)
    assert found["oracle"]["pixel_ause"] == pytest.approx(0, abs=1e-12)
    assert 0.01 < found["a"]["pixel_ause"] < found["a"]["pixel_ause_chance"]
    assert set(found["flat"].values()) == {None}
    assert set(measures.evaluate_pixels({"a": score}, np.full_like(error, np.nan))["a"].values()) == {None}
    with pytest.raises(ValueError, match="not finite"):
        measures.evaluate_pixels({"a": np.where(score < 0.1, np.nan, score)}, error)


def test_a_result_leaves_out_poses_without_error_and_is_json():
    rng = np.random.default_rng(7)
    error, maps = rng.uniform(0.1, 1, 12), rng.uniform(size=(12, 8, 8))
    score, pixels = error.copy(), maps.copy()
    error[3], maps[3], score[3] = np.nan, np.nan, 99.0
    found = measures.summarise({"a": score, "b": -score}, {"a": pixels}, error, list(maps), seed=0)
    assert found["poses"] == 11 and found["error_mean"] == pytest.approx(np.nanmean(error)) and found["level"] == 0.9
    assert found["scores"]["a"]["spearman"] == pytest.approx(1) == found["scores"]["a"]["pixel_spearman"]
    assert found["scores"]["b"]["spearman"] == pytest.approx(-1) and "pixel_spearman" not in found["scores"]["b"]
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    none = measures.summarise({"a": score[3:4]}, {"a": pixels[3:4]}, error[3:4], [maps[3]], seed=0)
    assert none["poses"] == 0 and none["error_mean"] is None and set(none["scores"]["a"].values()) == {None}
