"""When rounds stop: at a number of photos that is never exceeded, or where the next ones gain too little.

What they gain follows from how much worse photos were shown before they were fitted to.
"""

import json
import logging
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.files import write_json
from dav_gswt.views import stopping
from dav_gswt.views.selection import PoseSelection, write_pose_selection
from dav_gswt.views.stopping import SHARE, SPREAD, StoppingState, decide_poses, predict_gain


def fit(*unseen, taken=True, level=25.0):
    new = {"photos": len(unseen), "taken": taken, "views": [{"psnr_before": v} for v in unseen]}
    return {"new_views": new, "earlier_views": {"psnr_before": level} if unseen else None}


def behind(gap):
    """Reports of two rounds of two photos each after 8, all shown worse than the others: by gap, and gap 8 / 10 dB."""
    return [fit(25 - gap, 25 - gap), fit(25 - 0.8 * gap, 25 - 0.8 * gap)]


def known(taken=8, fits=(), left=100, stopped=None, start=8):
    return StoppingState(start, taken, list(fits), left, stopped)


def test_nothing_asked_or_known_stops_nothing_but_an_empty_pool_and_an_earlier_stop(caplog):
    found = decide_poses({}, 4, 1, known(10_000))
    assert (found.poses, found.stopped, found.expected) == (4, None, None)
    assert decide_poses({}, 4, 1, known(left=0)).stopped == "after 8 photos: no candidate pose is left"
    found = decide_poses({"marginal_gain": 0.01}, 4, 1, known(16, behind(3.0), stopped="after 16 photos: enough"))
    assert found.poses == 0 and found.stopped == "after 16 photos: enough"
    with caplog.at_level(logging.INFO):
        found = decide_poses({"marginal_gain": 100}, 2, 1, known(10, [fit(20.0, 30.0)]))  # two photos say too little
    assert (found.poses, found.stopped, found.expected) == (2, None, None)
    assert "cannot be predicted yet" in caplog.text


@settings(max_examples=40)
@given(*(st.integers(*ends) for ends in ((2, 40), (3, 60), (1, 20), (1, 10), (0, 60), (0, 30))))
def test_a_budget_is_never_exceeded_and_used_as_far_as_bursts_allow(start, budget, k, burst, left, rounds):
    taken, stopped = start, None
    for _ in range(rounds):
        found = decide_poses({"photos": budget}, k, burst, known(taken, left=left, stopped=stopped, start=start))
        assert found.poses <= k and (found.poses == 0) == (found.stopped is not None)
        asked = min(found.poses, left)
        taken, left, stopped = taken + asked * burst, left - asked, found.stopped
        assert taken <= max(budget, start)
    if stopped:
        assert left == 0 or taken + burst > budget


def test_the_last_round_takes_fewer_and_then_no_more():
    first, then = (decide_poses({"photos": 15}, 4, 2, known(taken)) for taken in (10, 14))
    assert (first.poses, first.stopped, then.poses) == (2, None, 0)
    assert then.stopped == "after 14 photos: a pose takes 2, and 15 in all may be taken (stop.photos)"


@pytest.mark.parametrize("dearer, stops", [(0.99, False), (1.01, True)])
def test_a_price_above_what_the_next_photos_are_worth_stops(dearer, stops, caplog):
    """A gap of 10 dB at 8 photos is 80 / n; two after 12 close 80 (1 / 12 - 1 / 14) = 0.952 dB: a share is won."""
    each, total = SHARE * 80 * (1 / 12 - 1 / 14) / 2, f"{SHARE * 0.952:.2f}"
    with caplog.at_level(logging.INFO):
        found = decide_poses({"marginal_gain": dearer * each}, 2, 1, known(12, behind(10.0)))
    assert found.expected.each == pytest.approx(each) and (found.stopped is not None) == stops
    assert f"the next 2 photos are expected to gain about {total} dB (" in caplog.text
    expected = json.loads(json.dumps(found.expected_gain(), allow_nan=False))
    assert expected["gain_per_photo"] == pytest.approx(each) and expected["photos"] == 2
    if stops:
        assert found.stopped.startswith(f"after 12 photos: the next 2 photos are expected to gain about {total} dB")
        assert found.stopped.endswith(f"less than {dearer * each:g} (stop.marginal_gain)") and found.poses == 0


def test_what_comes_counts_bursts_the_budget_and_the_pool():
    assert decide_poses({}, 4, 3, known(12, behind(1.0))).expected.photos == 12
    assert decide_poses({"photos": 15}, 4, 1, known(12, behind(1.0))).expected.photos == 3
    assert decide_poses({}, 4, 1, known(12, behind(1.0), left=2)).expected.photos == 2
    spent = decide_poses({"photos": 12, "marginal_gain": 0.001}, 4, 1, known(12, behind(1.0)))
    assert "stop.photos" in spent.stopped and spent.expected.photos == 4  # what more would be worth


def test_files_of_a_job(tmp_path):
    write_pose_selection(tmp_path / "poses.json", PoseSelection("farthest", 4, [], "enough"))
    write_json(tmp_path / "fit.json", fit(20.0))
    later = SimpleNamespace(fits=[tmp_path / "fit.json"], last=tmp_path / "poses.json", get=lambda key: key)
    assert stopping.read_state(later, 8, 9, 5) == StoppingState(8, 9, [fit(20.0)], 5, "enough")
    first = SimpleNamespace(fits=[], get=lambda key: None)
    assert stopping.read_state(first, 8, 8, 5) == StoppingState(8, 8, [], 5, None)


def by_law(c, sizes, each):
    """Photos shown c / n dB worse than the photos that a field of n photos was fitted to, times n."""
    return [n * (c / n) for n in sizes for _ in range(each)]


@pytest.mark.parametrize("sizes", [(8,), (8, 12, 16)])
def test_the_law_is_found_whatever_the_rounds(sizes):
    found = predict_gain(by_law(40.0, sizes, 3), 20, 4)
    assert found.gain == pytest.approx(SHARE * 40 * (1 / 20 - 1 / 24)) and found.photos == 4
    assert found.closes == pytest.approx(40 * (1 / 20 - 1 / 24))


def test_the_interval_is_that_of_the_share_and_of_how_far_photos_differ():
    share = 3.182446 * SPREAD * np.sqrt(1.25)  # Student's t of 3 degrees of freedom, from a table
    same = predict_gain(by_law(40.0, (8, 12), 4), 16, 4)
    wide = np.exp(share)
    assert (same.low, same.high) == pytest.approx((same.gain / wide, same.gain * wide), rel=1e-5)
    # n times the gap is 30, 40 and 50: 40 with a standard error of 10 / sqrt(3)
    found = predict_gain([30.0, 40.0, 50.0], 16, 4)
    wide = np.exp(np.hypot(share, 1.959964 * 10 / 3**0.5 / 40))
    assert found.gain == pytest.approx(same.gain)
    assert (found.low, found.high) == pytest.approx((found.gain / wide, found.gain * wide), rel=1e-5)


def test_photos_that_are_shown_as_well_as_the_others_promise_nothing():
    found = predict_gain([-4.0, -3.2, -4.8], 12, 4)
    assert (found.gain, found.low, found.high, found.each, found.closes) == (0, 0, 0, 0, 0)
    unsure = predict_gain([-30.0, 20.0, 7.0], 12, 4)  # -1 with a standard error of 14.98
    assert unsure.gain == unsure.low == 0
    assert unsure.high == pytest.approx(SHARE * (1 / 12 - 1 / 16) * (1.959964 * 14.9778 - 1), rel=1e-4)


def test_with_fewer_than_three_photos_that_count_or_nothing_to_come_nothing_is_said():
    for gaps in ([], [16.0, 9.0]):
        assert predict_gain(gaps, 12, 4) is None
    assert predict_gain([16.0, 16.8, 15.2], 12, 0) is None


def test_reports_tell_the_gap_and_what_each_field_was_fitted_to():
    reports = [fit(20.0, 21.0), fit(5.0, taken=False), fit(22.0, None, level=24.0), fit(), fit(20.0, level=None)]
    told, fitted = stopping.build_history(reports, 8)
    assert told == [8 * 5.0, 8 * 4.0, 10 * 2.0] and fitted == 13
    assert predict_gain(told, fitted, 3).photos == 3
