import json
import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from dav_gswt_study.calibration import agreement as un


def test_spearman_is_scipys_and_none_where_a_rank_means_nothing():
    rng = np.random.default_rng(0)
    u, error = rng.normal(size=(2, 50)).round(1)
    assert un.spearman(u, error) == pytest.approx(float(spearmanr(u, error).statistic))
    assert un.spearman(u, np.exp(u)) == pytest.approx(1) and un.spearman(u, -u) == pytest.approx(-1)
    assert un.spearman(u, np.ones(50)) is None and un.spearman(u[:1], error[:1]) is None
    with pytest.raises(ValueError, match="not finite: the error"):
        un.spearman(u, np.where(np.arange(50) == 4, np.nan, error))


def test_ause_by_hand_at_the_extremes_and_of_nonsense():
    error = np.array([1.0, 2.0, 3.0])
    # left of all: 2; oracle leaves out 3, then 2: 1.5 and 1. A score the wrong way round: 2.5 and 3.
    oracle, wrong = np.array([2, 1.5, 1]) / 2, np.array([2, 2.5, 3]) / 2
    assert un.ause(-error, error) == pytest.approx(np.trapezoid(wrong - oracle, dx=1 / 3))
    # a score that is constant: each sample counts with the mean error
    assert un.ause(np.zeros(3), error) == pytest.approx(np.trapezoid(1 - oracle, dx=1 / 3))
    u = np.arange(4.0)
    assert un.ause(u, np.zeros(4)) == 0 and un.ause(u[:1], np.ones(1)) == 0
    assert un.ause(u, u[::-1] * 1e307) == pytest.approx(un.ause(u, u[::-1]))
    for bad in (np.zeros(0), -np.ones(4)):
        with pytest.raises(ValueError, match="sparsification needs"):
            un.ause(u[: len(bad)], bad)


@pytest.mark.parametrize("n, level", [(1, 0.5), (9, 0.9), (10, 0.7), (19, 0.95), (50, 0.9)])
def test_the_conformal_quantile_covers_exactly_its_rank_of_exchangeable_samples(n, level):
    """Each of n + 1 samples in turn is the new one: all turns are equally probable, so their share is the coverage."""
    values = np.random.default_rng(n).normal(size=n + 1)
    covered = sum(v <= un.conformal_quantile(np.delete(values, i), level) for i, v in enumerate(values))
    rank = math.ceil(round((n + 1) * level, 9))
    assert covered == min(rank, n + 1) and covered >= level * (n + 1) - 1e-9


def test_a_score_that_knows_the_errors_and_one_that_knows_nothing():
    rng = np.random.default_rng(0)
    error = rng.exponential(1, 300)
    scores = {"oracle": error**2, "reversed": -error, "nothing": rng.normal(size=300)}
    found = un.evaluate_scores(scores, error, seed=0)
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
        (found,) = un.evaluate_scores({"a": np.arange(count, dtype=float)}, error, 0).values()
        assert len(found) == 5 and {key for key, value in found.items() if value is not None} == said
    error = np.arange(50.0)
    found = un.evaluate_scores({"a": np.ones(50), "b": error}, error, 0)
    assert set(found["a"].values()) == {None} and None not in found["b"].values()
    with pytest.raises(ValueError, match="not finite"):
        un.evaluate_scores({"a": np.where(error == 3, np.nan, error)}, error, 0)


def test_a_result_leaves_out_poses_without_error_and_is_json():
    rng = np.random.default_rng(7)
    error = rng.uniform(0.1, 1, 12)
    score = error.copy()
    error[3], score[3] = np.nan, 99.0
    found = un.summarise({"a": score, "b": -score}, error, seed=0)
    assert found["poses"] == 11 and found["error_mean"] == pytest.approx(np.nanmean(error)) and found["level"] == 0.9
    assert found["scores"]["a"]["spearman"] == pytest.approx(1) == -found["scores"]["b"]["spearman"]
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    none = un.summarise({"a": score[3:4]}, error[3:4], seed=0)
    assert none["poses"] == 0 and none["error_mean"] is None and set(none["scores"]["a"].values()) == {None}
