import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.tiles.layout import CENTRE, W, edge_colours
from dav_gswt_study.refine import limits, viewpoints

SIDE, N = 8.0, 32
WHOLE = np.full((N, N), CENTRE, np.uint8)


def labels(margin=6):
    out = np.full((N, N), W, np.uint8)
    out[margin:-margin, margin:-margin] = CENTRE
    return out


def disc(x, y, sigma):
    mean, scales = np.float32([[x, y, 0]]), np.full((1, 3), np.log(sigma), np.float32)
    zero, sh = np.zeros(1, np.float32), rgb_to_sh(np.full((1, 3), 0.5))
    return GaussianField(mean, scales, np.float32([[1, 0, 0, 0]]), zero, sh, zero, np.ones(1, bool))


def test_a_seam_is_the_two_cells_on_either_side_of_the_cut_around_the_centre():
    cut = limits.find_seam(labels())
    assert cut[6, 6:-6].all() and cut[5, 6:-6].all() and not cut[5, 5] and not cut[7, 7:-7].any()
    assert not limits.find_seam(WHOLE).any()
    framed = labels()
    framed[:6, :10] = 5  # a cut within the frame is no part of it
    np.testing.assert_array_equal(limits.find_seam(framed), cut)


def test_shares_are_largest_at_the_cut_and_end_at_the_reach_and_at_the_border():
    share = limits.compute_shares(labels(10), 4.0, 8.0)
    assert share[16, 10] == 1 and share[16, 9] == 1 and 0 < share[16, 12] < share[16, 11] < 1
    assert share[16, 14] == pytest.approx(0, abs=1e-12) and share[16, 16] == pytest.approx(0, abs=1e-12)
    near = limits.compute_shares(labels(4), 40.0, 8.0)
    assert (np.diff(near[16, :4]) > 0).all() and near[16, 0] < 0.02
    assert not limits.compute_shares(WHOLE, 4.0, 8.0).any()


@given(st.floats(0.01, 7.99), st.floats(0.01, 7.99), st.floats(0.01, 1.5), st.floats(0, 1))
def test_nothing_that_reaches_a_border_may_change_and_nothing_may_come_to_reach_one(x, y, sigma, share):
    found = limits.compute_bounds(disc(x, y, sigma), np.full((N, N), share), SIDE, 0.1, 0.5, 0.2)
    room = min(x, y, SIDE - x, SIDE - y) - limits.RIM * sigma
    if room < -1e-6:
        assert not found.free.any() and not found.scale.any()
    assert found.position[0] <= max(room, 0) + 1e-6 and found.position[0] <= 0.2 * share
    assert found.colour[0] <= 0.1 * share and found.opacity[0] <= 0.5 * share


def test_a_needle_reaches_as_far_as_it_is_long_in_the_direction_it_lies():
    field = disc(4.0, 1.0, 0.1)
    field.log_scales[0, 0] = np.log(0.5)
    assert limits.border_clearance(field, SIDE)[0] == pytest.approx(1 - 0.333, abs=1e-5)
    field.quats[0] = [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)]  # now along y
    assert limits.border_clearance(field, SIDE)[0] == pytest.approx(1 - 3.33 * 0.5, abs=1e-5)


def test_every_part_of_a_cut_is_near_a_place():
    one = np.full((40, 40), W, np.uint8)
    one[7:30, 9:33] = CENTRE
    found, seam = viewpoints.find_seam_points(one, 12), limits.find_seam(one)
    for y, x in np.argwhere(seam):
        assert (np.abs(found - [x, y]).max(1) < 12).any()
    assert len(found) < 16 and seam[found[:, 1], found[:, 0]].all()


def test_edge_colours_meet_all_around_a_tile():
    for tile in range(32):
        around = viewpoints.neighbouring_tiles(tile)
        assert around[1, 1] == tile and (around // 16 == tile // 16).all()
        colours = {(j, i): edge_colours(int(around[j, i])) for j in range(3) for i in range(3)}
        assert all(colours[j, i][2] == colours[j, i + 1][0] for j in range(3) for i in range(2))
        assert all(colours[j, i][1] == colours[j + 1, i][3] for j in range(2) for i in range(3))
