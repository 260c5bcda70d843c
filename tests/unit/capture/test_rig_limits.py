"""Limits and no-go zones of a rig's axes, and the way between two poses."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.capture import rig_limits


@given(*[st.tuples(*[st.floats(-10, 10, width=32) for _ in range(3)]) for _ in range(2)])
def test_the_exact_test_of_a_move_agrees_with_many_points_on_it(a, b):
    limits = {axis: [-20, 20] for axis in rig_limits.AXES}
    zones = [{"pan": [-3, 1], "tilt": [0, 2], "radius": [-1, 4]}]
    there = rig_limits.combine_limits(limits, zones, np.array([[-20.0, 20]] * 3))
    a, b = np.array(a), np.array(b)
    points = a + np.linspace(0, 1, 2001)[:, None] * (b - a)
    box = there.zones[0]
    depth = np.minimum(points - box[:, 0], box[:, 1] - points).min(1).max()  # how deep the deepest point is inside
    met = rig_limits._touched_zones(there, a, b)[0]
    apart = 0.5 * np.abs(b - a).max() / 2000
    assert met if depth >= 0 else True
    assert not met or depth >= -apart - 1e-9


def test_a_pan_goes_the_short_way_round_where_the_limits_let_it():
    limits = {"pan": [-270, 270], "tilt": [0, 90], "radius": [1, 9]}
    there = rig_limits.combine_limits(limits, [], np.array([[-1e6, 1e6]] * 3))
    [stop] = rig_limits.plan_route(there, np.array([-170.0, 45.0, 5.0]), np.array([170.0, 45.0, 5.0]))
    assert stop[0] == -190.0
