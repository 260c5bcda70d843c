"""Shares: hand-worked values, and by simulation how often intervals hold what they should."""

import numpy as np
import pytest
from scipy.stats import binomtest

from dav_gswt.study.forced_choice import shares


def test_a_share_by_hand():
    """Shares .5, .75, 1: mean .75, variance of the mean .0625 / 3, worth .1875 / .0208333 = 9 answers; t = 1.5."""
    found = shares.clustered(np.array([4.0, 6.0, 8.0]), np.full(3, 8.0))
    assert (found.participants, found.answers, found.df) == (3, 24, 2)
    assert found.share == pytest.approx(0.75) and found.worth == pytest.approx(9.0)
    assert found.p == pytest.approx(1 - 1.5 / np.sqrt(2 + 1.5**2))  # Student's t with 2 degrees of freedom
    q = 4.302653
    ends = [abs(found.share - s) - q * np.sqrt(s * (1 - s) / 9) for s in (found.low, found.high)]
    assert ends == pytest.approx([0, 0], abs=1e-6)


def test_answers_that_do_not_depend_on_who_gave_them_are_worth_about_as_many_as_there_are():
    rng = np.random.default_rng(0)
    found = shares.clustered(rng.binomial(400, 0.7, 60).astype(float), np.full(60, 400.0))
    assert 0.6 * found.answers < found.worth <= found.answers


def test_where_all_agree_each_is_worth_one_answer():
    found = shares.clustered(np.full(5, 12.0), np.full(5, 12.0))
    assert (found.share, found.high, found.worth) == (1.0, 1.0, 5.0) and 0.3 < found.low < 0.5
    half = shares.clustered(np.full(5, 6.0), np.full(5, 12.0))
    assert half.p == pytest.approx(1.0) and half.low == pytest.approx(1 - half.high) and half.low > 0


def test_one_participant_has_a_share_and_no_interval():
    found = shares.clustered(np.array([9.0]), np.array([12.0]))
    assert found.share == 0.75 and (found.low, found.high, found.p, found.worth) == (None,) * 4


def test_the_plain_binomial_is_the_exact_one():
    low, high, p = shares.binomial(8, 10)
    assert p == pytest.approx(2 * (45 + 10 + 1) / 1024)
    assert binomtest(8, 10, low, "greater").pvalue == pytest.approx(0.025)
    assert binomtest(8, 10, high, "less").pvalue == pytest.approx(0.025)
    assert shares.binomial(0, 10)[0] == 0 and shares.binomial(10, 10)[1] == 1


@pytest.mark.parametrize("chosen, asked", [([], []), ([1.0], [0.0]), ([3.0], [2.0]), ([-1.0], [2.0])])
def test_what_is_no_share_is_refused(chosen, asked):
    with pytest.raises(ValueError, match="shares need"):
        shares.clustered(np.array(chosen), np.array(asked))


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
        found = shares.clustered(chosen.astype(float), np.full(people, float(answers)))
        low, high, _ = shares.binomial(int(chosen.sum()), people * answers)
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
