import numpy as np
import pytest

from dav_gswt_study import statistics


def test_scenes_count_alike_whatever_their_seeds_and_the_same_seed_says_the_same():
    mean, low, high = statistics.bootstrap_paired({"a": np.array([0.3, 0.01, 0.2]), "b": np.array([-0.2, 0.4])}, seed=0)
    assert mean == pytest.approx((0.17 + 0.1) / 2) and low < mean < high
    scenes = {"a": np.array([1, 1.1, 0.9]), "b": np.array([1.2, 1, 1])}
    one, two = (statistics.bootstrap_paired(scenes, seed=3) for _ in range(2))
    assert one == two and one[1] > 0.8
    for bad in ({"a": np.array([])}, {"a": np.array([1, np.inf])}):
        with pytest.raises(ValueError, match="differences"):
            statistics.bootstrap_paired(bad, seed=0)


def test_crops_of_one_cluster_count_as_one():
    """Twenty copies of each of four values: the interval is that of four, not of eighty."""
    sums = [statistics.sum_by_cluster((f"{k}", [float(k)]) for k in range(4) for _ in range(n)) for n in (1, 20)]
    first, second = (statistics.percentile_interval(statistics.bootstrap_clusters(each)[0][:, 0]) for each in sums)
    assert first == pytest.approx(second)


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


def test_a_share_by_hand():
    """Shares .5, .75, 1: mean .75, variance of the mean .0625 / 3, worth .1875 / .0208333 = 9 answers; t = 1.5."""
    found = statistics.compute_clustered_share(np.array([4.0, 6.0, 8.0]), np.full(3, 8.0))
    assert (found.participants, found.answers, found.df) == (3, 24, 2)
    assert found.share == pytest.approx(0.75) and found.effective_answers == pytest.approx(9.0)
    assert found.p == pytest.approx(1 - 1.5 / np.sqrt(2 + 1.5**2))  # Student's t with 2 degrees of freedom
    q = 4.302653
    ends = [abs(found.share - s) - q * np.sqrt(s * (1 - s) / 9) for s in (found.low, found.high)]
    assert ends == pytest.approx([0, 0], abs=1e-6)


def test_where_all_agree_each_is_worth_one_answer_and_one_participant_has_no_interval():
    found = statistics.compute_clustered_share(np.full(5, 12.0), np.full(5, 12.0))
    assert (found.share, found.high, found.effective_answers) == (1.0, 1.0, 5.0) and 0.3 < found.low < 0.5
    alone = statistics.compute_clustered_share(np.array([9.0]), np.array([12.0]))
    assert alone.share == 0.75 and (alone.low, alone.high, alone.p, alone.effective_answers) == (None,) * 4
    for chosen, asked in ([], []), ([1.0], [0.0]), ([3.0], [2.0]), ([-1.0], [2.0]):
        with pytest.raises(ValueError, match="shares need"):
            statistics.compute_clustered_share(np.array(chosen), np.array(asked))
