"""Nothing jumps while one walks: changes from frame to frame, beside those of the exactly sorted walk."""

import numpy as np
import pytest
from fixtures.terrains import MAGENTA, SIDE, manifest_of, stony_terrain

from dav_gswt.study.terrain import flicker
from dav_gswt.terrain import draw_order

BUDGET = 10**6
MANIFEST = manifest_of(eye_floor=1.0, ground_colour=MAGENTA)


@pytest.fixture(scope="module")
def stony():
    return stony_terrain()


def test_every_second_pair_of_frames_lies_across_a_border():
    found = flicker.make_frame_pairs(8, 3.0, 0.01)
    for k, (before, after) in enumerate(found):
        np.testing.assert_allclose(np.hypot(*np.subtract(after.at, before.at)), 0.01)
        assert (np.floor(before.at) != np.floor(after.at)).any() == bool(k % 2)


def test_a_slow_walk_in_pre_sorted_orders_jumps_no_more_than_twice_as_far(stony):
    found = flicker.measure_flicker(stony, MANIFEST, 6, 2.0, 96, 54, BUDGET)
    assert all(row["exact_largest"] > 0 for row in found)
    assert flicker.compare_largest_changes(found) < flicker.MAX_RATIO


def test_a_jump_is_found(stony, monkeypatch):
    """Orders that turn about from one frame to the next."""
    turns = iter(range(10**6))
    monkeypatch.setattr(draw_order, "nearest_order", lambda directions, kept, *_: next(turns) * 5 % len(kept))
    assert (
        flicker.compare_largest_changes(flicker.measure_flicker(stony, MANIFEST, 2, 1.0, 96, 54, BUDGET))
        > flicker.MAX_RATIO
    )


def test_the_way_is_counted_in_tiles(stony):
    (first, *_) = flicker.measure_flicker(stony, MANIFEST, 2, 1.0, 16, 9, BUDGET)
    assert (first["east"], first["north"]) == (0.5, 0.5) and stony.side == SIDE
