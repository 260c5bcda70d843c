"""What may be changed and by how much: nothing over a border, little far from a cut."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.study.refine import limits
from dav_gswt.tiles.layout import CENTRE, W

SIDE, N = 8.0, 32


def labels(margin=6):
    out = np.full((N, N), W, np.uint8)
    out[margin:-margin, margin:-margin] = CENTRE
    return out


def discs(places, sigma):
    n = len(places)
    return GaussianField(
        np.column_stack([places, np.zeros(n)]).astype(np.float32),
        np.log(np.float32(sigma)) * np.ones((n, 3), np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        np.zeros(n, np.float32),
        rgb_to_sh(np.full((n, 3), 0.5)),
        np.zeros(n, np.float32),
        np.ones(n, bool),
    )


def test_a_seam_is_the_two_cells_on_either_side_of_the_cut_around_the_centre():
    cut = limits.find_seam(labels())
    assert cut[6, 6:-6].all() and cut[5, 6:-6].all() and not cut[5, 5] and not cut[7, 7:-7].any()
    assert not limits.find_seam(np.full((N, N), CENTRE, np.uint8)).any()


def test_cuts_within_the_frame_are_no_part_of_it():
    framed = labels()
    framed[:6, :10] = 5
    np.testing.assert_array_equal(limits.find_seam(framed), limits.find_seam(labels()))


def test_shares_are_largest_at_the_cut_and_end_at_the_reach_and_at_the_border():
    share = limits.compute_shares(labels(10), 4.0, 8.0)
    assert share[16, 10] == 1 and share[16, 9] == 1 and 0 < share[16, 12] < share[16, 11] < 1
    assert share[16, 14] == pytest.approx(0, abs=1e-12) and share[16, 16] == pytest.approx(0, abs=1e-12)
    near = limits.compute_shares(labels(4), 40.0, 8.0)
    assert (np.diff(near[16, :4]) > 0).all() and near[16, 0] < 0.02
    assert not limits.compute_shares(np.full((N, N), CENTRE, np.uint8), 4.0, 8.0).any()


@given(st.floats(0.01, 7.99), st.floats(0.01, 7.99), st.floats(0.01, 1.5), st.floats(0, 1))
def test_nothing_that_reaches_a_border_may_change_and_nothing_may_come_to_reach_one(x, y, sigma, share):
    field = discs(np.array([[x, y]]), sigma)
    found = limits.compute_bounds(field, np.full((N, N), share), SIDE, 0.1, 0.5, 0.2)
    room = min(x, y, SIDE - x, SIDE - y) - limits.RIM * sigma
    if room < -1e-6:
        assert not found.free.any() and not found.scale.any()
    assert found.position[0] <= max(room, 0) + 1e-6 and found.position[0] <= 0.2 * share
    assert found.colour[0] <= 0.1 * share and found.opacity[0] <= 0.5 * share


def test_a_needle_reaches_as_far_as_it_is_long_in_the_direction_it_lies():
    field = discs(np.array([[4.0, 1.0]]), 0.1)
    field.log_scales[0, 0] = np.log(0.5)
    assert limits.border_clearance(field, SIDE)[0] == pytest.approx(1 - 0.333, abs=1e-5)
    field.quats[0] = [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)]  # now along y
    assert limits.border_clearance(field, SIDE)[0] == pytest.approx(1 - 3.33 * 0.5, abs=1e-5)
