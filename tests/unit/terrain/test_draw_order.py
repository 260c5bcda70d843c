"""Draw order: hand-worked rings, no cell before one that hides it (by rays), directions on slopes, the shared lists."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.bundle import orders
from dav_gswt.terrain import draw_order

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "draw_order.json").read_text())


def window(west, south, columns, rows):
    i, j = np.meshgrid(west + np.arange(columns), south + np.arange(rows))
    return i.ravel(), j.ravel()


@pytest.mark.parametrize("entry", GOLDEN["cells"], ids=lambda e: str(e["eye"]))
def test_cells_stand_in_the_order_shared_with_the_page(entry):
    i, j = window(*(entry[key] for key in ("west", "south", "columns", "rows")))
    sequence, _ = draw_order.sort_cells(i, j, tuple(entry["eye"]))
    assert np.stack([i, j], 1)[sequence].tolist() == entry["order"]
    assert draw_order.in_near_block(i, j, tuple(entry["eye"]))[sequence].tolist() == entry["close"]


def test_orders_are_those_shared_with_the_page():
    along = np.array(GOLDEN["along"])
    np.testing.assert_allclose(along, orders.DirectionRings().directions(), atol=1e-15)
    for entry in GOLDEN["orders"]:
        to, slope = np.array(entry["to"], float), np.array(entry["slope"], float)
        assert draw_order.nearest_order(along, entry["kept"], to, slope) == entry["position"]


def test_three_by_three_cells_are_worked_by_hand():
    i, j = window(0, 0, 3, 3)
    sequence, steps = draw_order.sort_cells(i, j, (0, 1))
    assert steps.tolist() == [1, 2, 3, 0, 1, 2, 1, 2, 3]
    expected = [(2, 0), (2, 2), (1, 0), (2, 1), (1, 2), (0, 0), (1, 1), (0, 2), (0, 1)]
    assert [(int(i[k]), int(j[k])) for k in sequence] == expected


@given(st.floats(0, 1, exclude_max=True), st.floats(0, 1, exclude_max=True), st.floats(-np.pi, np.pi))
def test_no_ray_meets_a_cell_before_one_that_is_drawn_after_it(x, y, angle):
    """The slow way: walk along a ray from the eye and note the cells in the order that it enters them."""
    i, j = window(-6, -6, 13, 13)
    sequence, _ = draw_order.sort_cells(i, j, (0, 0))
    place = {(int(i[k]), int(j[k])): at for at, k in enumerate(sequence)}
    t = np.arange(0, 6, 1e-3)
    met = np.floor(np.stack([x + t * np.cos(angle), y + t * np.sin(angle)], 1)).astype(int)
    entered = [tuple(int(v) for v in cell) for cell in met[np.r_[True, (np.diff(met, axis=0) != 0).any(1)]]]
    # a step of 1e-3 may cut a corner where two edges are met at once: those cells hide nothing of each other
    drawn = [place[cell] for cell in entered]
    assert drawn == sorted(drawn, reverse=True)


@given(st.integers(-50, 50), st.integers(-50, 50))
def test_the_order_goes_with_the_eye(di, dj):
    i, j = window(-3, -3, 7, 7)
    here, _ = draw_order.sort_cells(i, j, (0, 0))
    there, _ = draw_order.sort_cells(i + di, j + dj, (di, dj))
    assert here.tolist() == there.tolist()


def test_the_cells_about_the_eye_are_nine():
    i, j = window(-4, -4, 9, 9)
    close = draw_order.in_near_block(i, j, (1, -2))
    assert close.sum() == 9 and set(i[close].tolist()) == {0, 1, 2} and set(j[close].tolist()) == {-3, -2, -1}


def test_on_level_ground_the_nearest_direction_is_that_of_the_least_angle():
    along = orders.DirectionRings().directions()
    east = np.array([1.0, 0.0, -np.tan(np.radians(20.0))])
    assert draw_order.nearest_order(along, list(range(17)), east, np.zeros(2)) == 0
    assert draw_order.nearest_order(along, [8, 16, 4, 0], east, np.zeros(2)) == 3, "a position in what is kept"
    assert draw_order.nearest_order(along, list(range(17)), np.array([0.1, 0.0, -1.0]), np.zeros(2)) == 16


@given(st.floats(-2, 2), st.floats(-2, 2), st.integers(0, 2**32 - 1))
def test_on_a_slope_the_order_is_that_of_the_slope(east, north, seed):
    """Seen along one of the directions' images under J^-T, depths on the slope are that direction's on level ground."""
    rng = np.random.default_rng(seed)
    along, which = orders.DirectionRings().directions(), int(rng.integers(17))
    flat = rng.normal(size=(30, 3))
    slope = np.array([east, north])
    draped = flat + (flat[:, :2] @ slope)[:, None] * [0, 0, 1]
    to = along[which] - np.array([east, north, 0]) * along[which, 2]
    np.testing.assert_allclose(draped @ to, flat @ along[which], atol=1e-12)
    assert draw_order.nearest_order(along, list(range(17)), to, slope) == which
