"""When rounds stop: at a number of photos that is never exceeded, or where the next ones gain too little."""

import json
import logging
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.files import write_json
from dav_gswt.views import stopping
from dav_gswt.views.marginal_gain import SHARE
from dav_gswt.views.selection import PoseSelection, write_pose_selection
from dav_gswt.views.stopping import StoppingState, decide_poses


def fit(*unseen, taken=True):
    rows = [{"view": f"v{i}", "psnr_before": float(v), "psnr_after": 0.0} for i, v in enumerate(unseen)]
    new = {"photos": len(rows), "taken": taken, "views": rows}
    return {"new_views": new, "earlier_views": {"psnr_before": 25.0}}


def behind(gap):
    """Reports of two rounds of two photos each after 8, all shown worse than the others: by gap, and gap 8 / 10 dB."""
    return [fit(25 - gap, 25 - gap), fit(25 - 0.8 * gap, 25 - 0.8 * gap)]


def known(taken=8, fits=(), left=100, stopped=None, start=8):
    return StoppingState(start, taken, list(fits), left, stopped)


def test_nothing_asked_stops_nothing():
    for taken in (8, 10_000):
        found = decide_poses({}, 4, 1, known(taken))
        assert (found.poses, found.stopped, found.expected) == (4, None, None)


@given(
    st.integers(2, 40),
    st.integers(3, 60),
    st.integers(1, 20),
    st.integers(1, 10),
    st.integers(0, 60),
    st.integers(0, 30),
)
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
    first = decide_poses({"photos": 15}, 4, 2, known(10))
    assert (first.poses, first.stopped) == (2, None)
    then = decide_poses({"photos": 15}, 4, 2, known(14))
    assert (
        then.poses == 0 and then.stopped == "after 14 photos: a pose takes 2, and 15 in all may be taken (stop.photos)"
    )


def test_a_stop_stays_with_its_reason():
    found = decide_poses({"marginal_gain": 0.01}, 4, 1, known(16, behind(3.0), stopped="after 16 photos: enough"))
    assert found.poses == 0 and found.stopped == "after 16 photos: enough"


def test_an_empty_pool_stops():
    assert decide_poses({}, 4, 1, known(left=0)).stopped == "after 8 photos: no candidate pose is left"


@pytest.mark.parametrize("dearer, stops", [(0.2, False), (0.99, False), (1.01, True), (20, True)])
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


def test_before_three_new_photos_nothing_stops_and_that_is_said(caplog):
    with caplog.at_level(logging.INFO):
        found = decide_poses({"marginal_gain": 100}, 2, 1, known(10, [fit(20.0, 30.0)]))
    assert found.stopped is None and found.poses == 2 and found.expected is None
    assert "cannot be predicted yet" in caplog.text


def test_what_comes_counts_bursts_the_budget_and_the_pool():
    assert decide_poses({}, 4, 3, known(12, behind(1.0))).expected.photos == 12
    assert decide_poses({"photos": 15}, 4, 1, known(12, behind(1.0))).expected.photos == 3
    assert decide_poses({}, 4, 1, known(12, behind(1.0), left=2)).expected.photos == 2


def test_a_budget_that_is_spent_is_told_with_what_more_would_be_worth():
    found = decide_poses({"photos": 12, "marginal_gain": 0.001}, 4, 1, known(12, behind(1.0)))
    assert "stop.photos" in found.stopped and found.expected.photos == 4


def test_files_of_a_job(tmp_path):
    write_pose_selection(tmp_path / "poses.json", PoseSelection("farthest", 4, [], "enough"))
    write_json(tmp_path / "fit.json", fit(20.0))
    later = SimpleNamespace(fits=[tmp_path / "fit.json"], last=tmp_path / "poses.json", get=lambda key: key)
    assert stopping.read_state(later, 8, 9, 5) == StoppingState(8, 9, [fit(20.0)], 5, "enough")
    first = SimpleNamespace(fits=[], get=lambda key: None)
    assert stopping.read_state(first, 8, 8, 5) == StoppingState(8, 8, [], 5, None)
