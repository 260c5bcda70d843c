"""How far borders stray at each width: of straight, wavy, frayed and hidden borders."""

import numpy as np
import pytest

from dav_gswt.materials.borders import WIDTHS, measure_share, measure_strays

CELLS, TILE = 240, 120.0
EVERY = np.ones((CELLS, CELLS), bool)
AWAY = np.broadcast_to(np.arange(CELLS) - CELLS / 2 + 0.5, (CELLS, CELLS))  # from the middle column


def paint(share):
    """Features of two colours that are mixed by a share."""
    return share[..., None] * np.array([10.0, 0.0, 5.0]) + (1 - share[..., None]) * np.array([-10.0, 3.0, 0.0])


def wave(height, length):
    return height * np.sin(np.arange(CELLS) / length * 2 * np.pi)[:, None] < AWAY


def strays_of(own, counted=EVERY, tile=TILE):
    return measure_strays(own.astype(float), counted, tile)


@pytest.mark.parametrize("height, length", [(0.0, 80.0), (4.0, 120.0), (4.0, 80.0), (2.0, 40.0)])
def test_a_wave_strays_at_each_width_by_what_that_and_the_next_filter_leave_of_it(height, length):
    left = [np.exp(-2 * (np.pi * width * TILE / length) ** 2) for width in (2 * WIDTHS[0], *WIDTHS)]
    expected = 2 / np.pi * height * np.diff(left)[:3]  # the narrowest width is not resolved
    # a line at no angle to the grid is shorter than pi / 4 of its crossings say
    assert np.array(strays_of(wave(height, length))) * np.pi / 4 == pytest.approx(expected, rel=0.25, abs=0.25)


def test_colours_show_the_fray_that_smooth_labels_hide_but_no_texture():
    smooth, fringe = AWAY > 0, wave(6.0, 20.0)
    texture = np.random.default_rng(1).normal(0, 6, (CELLS, CELLS, 3))
    seen, none = (measure_share(paint(own.astype(float)) + texture, smooth, EVERY, TILE) for own in (fringe, smooth))
    true = strays_of(fringe)[2]
    assert measure_strays(seen, EVERY, TILE)[2] == pytest.approx(true, rel=0.2)
    assert measure_strays(none, EVERY, TILE)[2] < 0.2 * true


@pytest.mark.parametrize("hidden", [True, False])
def test_labels_count_where_colours_do_not_tell(hidden):
    own, nothing = wave(6.0, 20.0), np.zeros((CELLS, CELLS, 3))
    colours = paint(own.astype(float)) if hidden else nothing + np.random.default_rng(2).normal(0, 1, nothing.shape)
    counted = np.abs(AWAY) > 20 if hidden else EVERY
    assert (measure_share(colours, own, counted, TILE) == own).all()
