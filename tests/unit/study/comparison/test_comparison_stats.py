"""Areas, photos to reach, and intervals that hold what they say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.study.comparison import stats


def curve(*values):
    return np.array(values, float)


def test_the_area_of_a_line_is_its_middle():
    assert stats.nauc(curve(8, 12, 20), curve(20, 24, 32)) == pytest.approx(26)
    assert stats.nauc(curve(8, 16), curve(30, 30)) == 30


@given(rise=st.floats(-50, 50), stretch=st.integers(1, 20), move=st.integers(0, 100))
def test_the_area_moves_with_the_curve_and_not_with_the_count(rise, stretch, move):
    photos, psnr = curve(8, 10, 17), curve(21, 25, 26)
    area = stats.nauc(photos, psnr)
    assert stats.nauc(move + stretch * photos, psnr + rise) == pytest.approx(area + rise)


@pytest.mark.parametrize(
    ("photos", "psnr"), [((8,), (20,)), ((8, 8), (20, 21)), ((8, 7), (20, 21)), ((8, 9), (20, np.nan))]
)
def test_what_is_no_curve_is_refused(photos, psnr):
    with pytest.raises(ValueError, match="a curve"):
        stats.nauc(curve(*photos), curve(*psnr))


def test_photos_to_reach_lie_between_rounds():
    photos, psnr = curve(8, 12, 16), curve(20, 24, 28)
    assert stats.to_reach(photos, psnr, best=30.0, way=0.6) == pytest.approx(14)  # 26 dB
    assert stats.to_reach(photos, psnr, best=40.0, way=0.95) is None
    assert stats.to_reach(photos, psnr, best=20.0) == 8


def test_an_interval_holds_the_truth_as_often_as_it_says(monkeypatch):
    """Scenes and seeds both vary; over 200 studies the 90 % interval misses about 20, a little more for few scenes."""
    monkeypatch.setattr(stats, "DRAWS", 400)
    inside = 0
    for study in range(200):
        rng = np.random.default_rng(study)
        scenes = {str(i): 0.3 + rng.normal(0, 0.2) + rng.normal(0, 0.2, 4) for i in range(12)}
        found = stats.compared(scenes, seed=study, level=0.9)
        inside += found.low <= 0.3 <= found.high
    assert 165 <= inside <= 195


def test_wins_ties_and_losses():
    found = stats.compared({"a": curve(0.3, 0.01), "b": curve(-0.2, 0.4)}, seed=0)
    assert (found.wins, found.ties, found.losses) == (2, 1, 1)
    assert found.mean == pytest.approx((0.155 + 0.1) / 2) and found.low < found.mean < found.high


def test_a_sure_win_is_sure_and_the_same_seed_says_the_same():
    one, two = (stats.compared({"a": curve(1, 1.1, 0.9), "b": curve(1.2, 1, 1)}, seed=3) for _ in range(2))
    assert one == two and one.low > 0.8 and one.p == pytest.approx(2 / stats.DRAWS)
    nothing = stats.compared({"a": curve(0, 0)}, seed=0)
    assert (nothing.low, nothing.high, nothing.p) == (0, 0, 1)


def test_scenes_count_alike_whatever_their_seeds():
    assert stats.compared({"a": curve(*[1.0] * 9), "b": curve(0)}, seed=0).mean == 0.5


@pytest.mark.parametrize("bad", [{}, {"a": curve()}, {"a": curve(1, np.inf)}])
def test_nothing_to_compare_is_refused(bad):
    with pytest.raises(ValueError, match="differences"):
        stats.compared(bad, seed=0)


def test_holm_raises_the_smallest_most_and_keeps_the_order():
    assert stats.holm({"a": 0.01, "b": 0.04, "c": 0.03}) == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})
    assert stats.holm({"a": 0.9, "b": 0.8}) == pytest.approx({"b": 1.0, "a": 1.0})
