"""What the next photos are worth, from how photos were shown before they were fitted to."""

import numpy as np
import pytest

from dav_gswt.active import worth
from dav_gswt.active.worth import History, Round, expected


def by_law(slope, sizes, each, noise=0.0, seed=0):
    """Rounds of photos shown with 20 + slope ln n dB by fields of n photos."""
    rng = np.random.default_rng(seed)
    return [Round(n, list(20 + slope * np.log(n) + noise * rng.normal(size=each))) for n in sizes]


@pytest.mark.parametrize("slope", [3.0, 0.0, -1.0])
def test_the_law_is_found_and_goes_on_falling(slope):
    rounds = by_law(slope, (8, 12), 2)
    found = expected(History(rounds, 16, 4))
    assert found.gain == pytest.approx(slope * np.log(20 / 16), abs=1e-9) and found.photos == 4
    assert found.low == pytest.approx(found.gain, abs=1e-6) == found.high
    later = expected(History(rounds, 32, 4))
    assert abs(later.each) <= abs(found.each)


def test_the_interval_is_that_of_least_squares():
    """Against scipy's own regression."""
    from scipy.stats import linregress
    from scipy.stats import t as student

    rounds = by_law(2.0, (8, 12, 16), 4, noise=0.7)
    n = np.repeat([8, 12, 16], 4)
    line = linregress(np.log(n), np.concatenate([r.unseen for r in rounds]))
    found, factor = expected(History(rounds, 20, 5)), np.log(25 / 20)
    assert found.gain == pytest.approx(factor * line.slope)
    assert found.high - found.gain == pytest.approx(factor * line.stderr * student.ppf(0.975, 10))
    assert found.gain - found.low == pytest.approx(found.high - found.gain)


def test_the_interval_holds_the_truth_as_often_as_it_says():
    """400 draws of a 95 % interval miss 20 times; more than 40 or fewer than 5 is a chance below 1 in 10 000."""
    truth, missed = 2.0 * np.log(20 / 16), 0
    for seed in range(400):
        found = expected(History(by_law(2.0, (8, 12), 4, noise=1.0, seed=seed), 16, 4))
        missed += not found.low <= truth <= found.high
    assert 5 <= missed <= 40


@pytest.mark.parametrize(
    "rounds, coming",
    [
        pytest.param([], 4, id="no round"),
        pytest.param([Round(8, [20.0, 21.0, 22.0])], 4, id="one round"),
        pytest.param([Round(8, [20.0]), Round(9, [21.0])], 4, id="two photos, nothing to know a spread by"),
        pytest.param([Round(8, [20.0, 21.0]), Round(10, [])], 4, id="a round without photos"),
        pytest.param([Round(8, [20.0, 21.0]), Round(10, [22.0])], 0, id="nothing to come"),
    ],
)
def test_where_nothing_can_be_said_nothing_is(rounds, coming):
    assert expected(History(rounds, 12, coming)) is None


def report(*unseen, taken=True):
    return {"new_views": {"photos": len(unseen), "taken": taken, "views": [{"psnr_before": v} for v in unseen]}}


def test_reports_tell_what_each_field_was_fitted_to():
    told = worth.history([report(20.0, 21.0), report(5.0, taken=False), report(22.0, None), report()], 8, 3)
    assert told == History([Round(8, [20.0, 21.0]), Round(10, [22.0]), Round(12, [])], 12, 3)
    assert expected(told).photos == 3
