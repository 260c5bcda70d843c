"""From where the study photographs synthetic scenes."""

import numpy as np
import pytest

from dav_gswt_study import synthetic_views

ENTRY = {"min_elevation": 60, "photo_count": 24, "test": 12, "size": 64}


def elevations(cameras):
    """In degrees, about the origin."""
    return np.degrees([np.arcsin(c.centre[2] / np.linalg.norm(c.centre)) for c in cameras])


def test_a_cap_is_photographed_and_tested_evenly_from_above_its_lowest_elevation():
    low = np.sin(np.radians(60))
    tests = synthetic_views.place_test_views(ENTRY, "cap", 8, 0)
    for cameras, count in ((synthetic_views.place_start_views(ENTRY, "cap"), 24), (tests["high"], 12)):
        height = np.sort(np.sin(np.radians(elevations(cameras))))
        # equal steps of height are equal areas of the sphere
        assert height == pytest.approx(low + (np.arange(count) + 0.5) / count * (1 - low), abs=1e-9)
    assert list(tests) == ["high", "oblique"] and elevations(tests["oblique"]) == pytest.approx(8 * [45])


@pytest.mark.parametrize("n, circle", [(100, 36), (72, 36), (71, 26), (50, 18), (3, 1)])
def test_a_paper_rig_has_36_in_100_views_on_a_circle_and_the_others_uniform_above_the_lowest(n, circle):
    places = synthetic_views.list_paper_places(n, 45.0, 30.0, 7.0)
    assert len(places) == n
    assert [e for e, _, _ in places[:circle]] == circle * [45.0]
    assert np.diff([a for _, a, _ in places[:circle]]) == pytest.approx((circle - 1) * [360 / circle])
    height = np.sin(np.radians([e for e, _, _ in places[circle:]]))
    # equal steps of height are equal areas of the sphere
    assert height == pytest.approx(1 - (np.arange(n - circle) + 0.5) / (n - circle) * 0.5)
