"""Statistics: hand-worked values, slow references, and intervals that cover the truth as often as they state."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats
from scipy.stats import binomtest

from dav_gswt.study import statistics


def curve(*values):
    return np.array(values, float)


def test_an_interval_holds_the_truth_as_often_as_it_says():
    """Scenes and seeds both vary; over 200 studies the 90 % interval misses about 20, a little more for few scenes."""
    inside = 0
    for study in range(200):
        rng = np.random.default_rng(study)
        scenes = {str(i): 0.3 + rng.normal(0, 0.2) + rng.normal(0, 0.2, 4) for i in range(12)}
        found = statistics.bootstrap_paired(scenes, seed=study, level=0.9, replicates=400)
        inside += found.low <= 0.3 <= found.high
    assert 165 <= inside <= 195


def test_wins_ties_and_losses():
    found = statistics.bootstrap_paired({"a": curve(0.3, 0.01), "b": curve(-0.2, 0.4)}, seed=0)
    assert (found.wins, found.ties, found.losses) == (2, 1, 1)
    assert found.mean == pytest.approx((0.155 + 0.1) / 2) and found.low < found.mean < found.high


def test_a_sure_win_is_sure_and_the_same_seed_says_the_same():
    one, two = (statistics.bootstrap_paired({"a": curve(1, 1.1, 0.9), "b": curve(1.2, 1, 1)}, seed=3) for _ in range(2))
    assert one == two and one.low > 0.8 and one.p == pytest.approx(2 / statistics.REPLICATES)
    nothing = statistics.bootstrap_paired({"a": curve(0, 0)}, seed=0)
    assert (nothing.low, nothing.high, nothing.p) == (0, 0, 1)


def test_scenes_count_alike_whatever_their_seeds():
    assert statistics.bootstrap_paired({"a": curve(*[1.0] * 9), "b": curve(0)}, seed=0).mean == 0.5


@pytest.mark.parametrize("bad", [{}, {"a": curve()}, {"a": curve(1, np.inf)}])
def test_nothing_to_compare_is_refused(bad):
    with pytest.raises(ValueError, match="differences"):
        statistics.bootstrap_paired(bad, seed=0)


def test_holm_raises_the_smallest_most_and_keeps_the_order():
    assert statistics.adjust_holm({"a": 0.01, "b": 0.04, "c": 0.03}) == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})
    assert statistics.adjust_holm({"a": 0.9, "b": 0.8}) == pytest.approx({"b": 1.0, "a": 1.0})


def test_no_p_value_needs_no_adjustment():
    assert statistics.adjust_holm({}) == {}


def test_crops_of_one_cluster_count_as_one():
    """Twenty copies of each of four values: the interval is that of four, not of eighty."""
    values = {f"{k}": float(k) for k in range(4)}
    few = statistics.sum_by_cluster((name, [v]) for name, v in values.items())
    many = statistics.sum_by_cluster((name, [v]) for name, v in values.items() for _ in range(20))
    first, second = (
        statistics.percentile_interval(statistics.bootstrap_clusters(each)[0][:, 0]) for each in (few, many)
    )
    assert first == pytest.approx(second)


VALUES = some.lists(some.floats(-5, 5), min_size=3, max_size=6).filter(lambda v: np.std(v) > 1e-3)


@settings(max_examples=15)  # each draws a bootstrap
@given(values=VALUES)
def test_one_scene_is_the_usual_paired_test(values):
    found, usual = statistics.compute_paired_test({"a": np.array(values)}), stats.ttest_1samp(values, 0.0)
    assert found.df == len(values) - 1 and found.units == len(values)
    assert found.t == pytest.approx(float(usual.statistic)) and found.p == pytest.approx(float(usual.pvalue))
    assert found.d == pytest.approx(np.mean(values) / np.std(values, ddof=1))


def test_scenes_far_apart_do_not_count_as_spread_of_seeds():
    """A slow twin: least squares of the differences on one mean a scene, and the variance of the means' mean."""
    a, b = np.array([1.0, 1.2, 0.9]), np.array([5.0, 5.3])
    found = statistics.compute_paired_test({"a": a, "b": b})
    design = np.array([[1, 0]] * 3 + [[0, 1]] * 2, float)
    means, squares, *_ = np.linalg.lstsq(design, np.concatenate([a, b]), rcond=None)
    covariance = squares[0] / 3 * np.linalg.inv(design.T @ design)
    half = np.array([0.5, 0.5])
    assert (found.df, found.units) == (3, 5)
    assert found.t == pytest.approx(float(half @ means / np.sqrt(half @ covariance @ half)))
    assert found.mean == pytest.approx(float(half @ means)) and found.low < found.mean < found.high


def test_what_cannot_be_told_is_not():
    one = statistics.compute_paired_test({"a": np.array([0.5])})
    assert (one.units, one.mean, one.low, one.t, one.df, one.p) == (1, 0.5, None, None, 0, None)
    each = statistics.compute_paired_test({"a": np.array([0.5]), "b": np.array([0.7])})
    assert each.t is None and each.df == 0 and each.low < each.mean < each.high
    alike = statistics.compute_paired_test({"a": np.array([0.5, 0.5])})
    assert (alike.t, alike.d, alike.df) == (None, None, 1)


def test_no_pair_is_an_error():
    with pytest.raises(ValueError, match="needs differences"):
        statistics.compute_paired_test({})


def test_a_share_by_hand():
    """Shares .5, .75, 1: mean .75, variance of the mean .0625 / 3, worth .1875 / .0208333 = 9 answers; t = 1.5."""
    found = statistics.compute_clustered_share(np.array([4.0, 6.0, 8.0]), np.full(3, 8.0))
    assert (found.participants, found.answers, found.df) == (3, 24, 2)
    assert found.share == pytest.approx(0.75) and found.effective_answers == pytest.approx(9.0)
    assert found.p == pytest.approx(1 - 1.5 / np.sqrt(2 + 1.5**2))  # Student's t with 2 degrees of freedom
    q = 4.302653
    ends = [abs(found.share - s) - q * np.sqrt(s * (1 - s) / 9) for s in (found.low, found.high)]
    assert ends == pytest.approx([0, 0], abs=1e-6)


def test_answers_that_do_not_depend_on_who_gave_them_are_worth_about_as_many_as_there_are():
    rng = np.random.default_rng(0)
    found = statistics.compute_clustered_share(rng.binomial(400, 0.7, 60).astype(float), np.full(60, 400.0))
    assert 0.6 * found.answers < found.effective_answers <= found.answers


def test_where_all_agree_each_is_worth_one_answer():
    found = statistics.compute_clustered_share(np.full(5, 12.0), np.full(5, 12.0))
    assert (found.share, found.high, found.effective_answers) == (1.0, 1.0, 5.0) and 0.3 < found.low < 0.5
    half = statistics.compute_clustered_share(np.full(5, 6.0), np.full(5, 12.0))
    assert half.p == pytest.approx(1.0) and half.low == pytest.approx(1 - half.high) and half.low > 0


def test_one_participant_has_a_share_and_no_interval():
    found = statistics.compute_clustered_share(np.array([9.0]), np.array([12.0]))
    assert found.share == 0.75 and (found.low, found.high, found.p, found.effective_answers) == (None,) * 4


def test_the_plain_binomial_is_the_exact_one():
    low, high, p = statistics.compute_binomial_test(8, 10)
    assert p == pytest.approx(2 * (45 + 10 + 1) / 1024)
    assert binomtest(8, 10, low, "greater").pvalue == pytest.approx(0.025)
    assert binomtest(8, 10, high, "less").pvalue == pytest.approx(0.025)
    assert statistics.compute_binomial_test(0, 10)[0] == 0 and statistics.compute_binomial_test(10, 10)[1] == 1


@pytest.mark.parametrize("chosen, asked", [([], []), ([1.0], [0.0]), ([3.0], [2.0]), ([-1.0], [2.0])])
def test_what_is_no_share_is_refused(chosen, asked):
    with pytest.raises(ValueError, match="shares need"):
        statistics.compute_clustered_share(np.array(chosen), np.array(asked))


def covered(people, answers, mean, alike, runs=600):
    """How often the true share lies in the clustered interval, and in the plain binomial's.

    A person's own share is drawn from a beta distribution; two answers of one person correlate by `alike`.
    """
    rng = np.random.default_rng(11)
    spread = 1 / alike - 1
    hits = np.zeros(2)
    for _ in range(runs):
        own = rng.beta(mean * spread, (1 - mean) * spread, people)
        chosen = rng.binomial(answers, own)
        found = statistics.compute_clustered_share(chosen.astype(float), np.full(people, float(answers)))
        low, high, _ = statistics.compute_binomial_test(int(chosen.sum()), people * answers)
        hits += [found.low <= mean <= found.high, low <= mean <= high]
    return hits / runs


@pytest.mark.parametrize("mean", [0.5, 0.85])
def test_the_clustered_interval_holds_the_truth_as_often_as_it_says_and_the_binomial_does_not(mean):
    """The paper's size: 18 people. 600 runs tell 95 % to +- 2.7 % (three deviations)."""
    clustered, plain = covered(18, 36, mean, 0.1)
    assert 0.92 < clustered < 0.98
    assert plain < 0.75


def test_with_few_people_the_interval_is_rather_too_wide():
    clustered, plain = covered(4, 36, 0.7, 0.1)
    assert clustered > 0.94 and plain < 0.75
