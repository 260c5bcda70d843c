"""Geometry of tiles, by hand."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.tiles import layout
from dav_gswt.tiles.layout import NE, NW, SE, SW, E, Layout, PatchPlaces, W

PLAN = Layout(exemplar=40, levels=1, side=10, strip=2, corner=3)
PLACES = PatchPlaces(
    np.array([30, 20]),
    np.array([[0, 1], [5, 2]]),
    np.array([[3, 30], [4, 25]]),
    np.tile([11, 12], (16, 1)),
)


@pytest.mark.parametrize("levels", [1, 3, 6, 8, layout.AUTO])
@pytest.mark.parametrize("exemplar", [32, 100, 448])
@pytest.mark.parametrize("strip", [0.05, 0.125, 0.3])
def test_a_tile_is_whole_in_the_cells_of_every_level(exemplar, levels, strip):
    plan = layout.plan_layout(exemplar, levels, 0.5, strip, fitted=3)
    assert plan.side <= exemplar and plan.side % 2 ** (plan.levels - 1) == 0
    assert plan.composed_levels <= 3 and plan.block == 2 ** (plan.composed_levels - 1)
    assert plan.side >= layout.MIN_BLOCKS * plan.block
    assert not any(v % plan.block for v in (plan.strip, plan.corner))
    assert plan.block < plan.strip < plan.corner < plan.side / 2
    # the first coarser level is composed of patches, too
    assert plan.composed_levels > 1 or plan.levels == 1 or plan.side < 2 * layout.MIN_BLOCKS


def test_auto_makes_the_levels_that_are_ever_drawn():
    # at least 3.5 cells of the coarsest level, rounded to four: 112 / 32 = 3.5, 96 / 32 = 3
    for side, levels in ((128, 6), (112, 6), (96, 5), (60, 5), (32, 4), (20, 3)):
        plan = layout.plan_layout(4 * side, layout.AUTO, 0.25, 0.125)
        assert plan.levels == levels and abs(plan.side - side) <= 2 ** (levels - 2)


def test_an_exemplar_smaller_than_any_tile_is_refused():
    with pytest.raises(InputError, match="needs 10 ground cells a side and the exemplar has 9"):
        layout.plan_layout(9, 3, 0.5, 0.16)


def test_a_vertical_strip_goes_on_from_a_tile_into_its_right_neighbour():
    left, right = layout.label_shifts(PLAN, PLACES, 2), layout.label_shifts(PLAN, PLACES, 8)
    y, n = 4, PLAN.side
    for step in (1, 2):  # cells from the border: strip columns 1, 0 on the left and 2, 3 on the right
        np.testing.assert_array_equal(left[E] + [n - step, y], PLACES.vertical[1] + [2 - step, y])
        np.testing.assert_array_equal(right[W] + [step - 1, y], PLACES.vertical[1] + [1 + step, y])


def test_the_corner_patch_is_whole_where_four_tiles_meet():
    shift = layout.label_shifts(PLAN, PLACES, 0)
    n, middle = PLAN.side, PLACES.corner + PLAN.corner
    np.testing.assert_array_equal(shift[SW] + [0, 0], middle)
    np.testing.assert_array_equal(shift[SE] + [n - 1, 0], middle + [-1, 0])
    np.testing.assert_array_equal(shift[NW] + [0, n - 1], middle + [0, -1])
    np.testing.assert_array_equal(shift[NE] + [n - 1, n - 1], middle - 1)
