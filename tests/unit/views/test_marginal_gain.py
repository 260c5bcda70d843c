"""What the next photos are worth, from how much worse photos were shown before they were fitted to."""

import numpy as np
import pytest

from dav_gswt.views import marginal_gain
from dav_gswt.views.marginal_gain import SHARE, SPREAD, FitHistory, RoundGaps, predict_gain


def by_law(c, sizes, each, noise=0.0, seed=0):
    """Rounds of photos shown c / n dB worse than those that a field of n photos was fitted to; noise of c."""
    rng = np.random.default_rng(seed)
    return [RoundGaps(n, list((c + noise * rng.normal(size=each)) / n)) for n in sizes]


@pytest.mark.parametrize("sizes", [(8,), (8, 12), (8, 12, 16)])
def test_the_law_is_found_whatever_the_rounds_and_goes_on_falling(sizes):
    rounds = by_law(40.0, sizes, 3)
    found = predict_gain(FitHistory(rounds, 20, 4))
    assert found.gain == pytest.approx(SHARE * 40 * (1 / 20 - 1 / 24)) and found.photos == 4
    assert found.closes == pytest.approx(40 * (1 / 20 - 1 / 24))
    later, more = predict_gain(FitHistory(rounds, 40, 4)), predict_gain(FitHistory(rounds, 20, 8))
    assert later.each < found.each and found.gain < more.gain < 2 * found.gain


def test_where_photos_agree_the_interval_is_that_of_the_share():
    found = predict_gain(FitHistory(by_law(40.0, (8, 12), 4), 16, 4))
    wide = np.exp(3.182446 * SPREAD * np.sqrt(1.25))  # Student's t of 3 degrees of freedom, from a table
    assert (found.low, found.high) == pytest.approx((found.gain / wide, found.gain * wide), rel=1e-5)


def test_the_interval_holds_another_scene_as_often_as_it_says(monkeypatch):
    """400 draws of a 95 % interval miss 20 times; more than 40 or fewer than 5 is a chance below 1 in 10 000.

    The share and how far it is off are found on four scenes; the gain is that of a fifth.
    """
    rng, missed = np.random.default_rng(1), 0
    for seed in range(400):
        scenes = rng.normal(np.log(0.5), 0.4, 5)
        monkeypatch.setattr(marginal_gain, "SHARE", float(np.exp(scenes[:4].mean())))
        monkeypatch.setattr(marginal_gain, "SPREAD", float(scenes[:4].std(ddof=1)))
        found = predict_gain(FitHistory(by_law(40.0, (8, 12), 4, noise=1.0, seed=seed), 16, 4))
        gained = 40.0 * (1 / 16 - 1 / 20) * np.exp(scenes[4])
        missed += not found.low <= gained <= found.high
    assert 5 <= missed <= 40


def test_photos_that_are_shown_as_well_as_the_others_promise_nothing():
    found = predict_gain(FitHistory([RoundGaps(8, [-0.5, -0.4, -0.6])], 12, 4))
    assert (found.gain, found.low, found.high, found.each, found.closes) == (0, 0, 0, 0, 0)
    unsure = predict_gain(FitHistory([RoundGaps(8, [-3.0, 2.0, 0.9])], 12, 4))
    assert unsure.gain == unsure.low == 0 < unsure.high


@pytest.mark.parametrize(
    "rounds, coming",
    [
        pytest.param([], 4, id="no round"),
        pytest.param([RoundGaps(8, [2.0]), RoundGaps(9, [1.0])], 4, id="two photos, nothing to know a spread by"),
        pytest.param([RoundGaps(8, []), RoundGaps(10, [])], 4, id="rounds without photos that count"),
        pytest.param([RoundGaps(8, [2.0, 2.1, 1.9])], 0, id="nothing to come"),
    ],
)
def test_where_nothing_can_be_said_nothing_is(rounds, coming):
    assert predict_gain(FitHistory(rounds, 12, coming)) is None


def report(*unseen, taken=True, level=25.0):
    rows = [{"psnr_before": v} for v in unseen]
    return {
        "new_views": {"photos": len(unseen), "taken": taken, "views": rows},
        "earlier_views": {"psnr_before": level} if unseen else None,
    }


def test_reports_tell_the_gap_and_what_each_field_was_fitted_to():
    reports = [report(20.0, 21.0), report(5.0, taken=False), report(22.0, None, level=24.0), report()]
    told = marginal_gain.build_history([*reports, report(20.0, level=None)], 8, 3)
    assert told == FitHistory([RoundGaps(8, [5.0, 4.0]), RoundGaps(10, [2.0]), RoundGaps(12, [])], 13, 3)
    assert predict_gain(told).photos == 3
