"""Colours that stand for numbers, and shapes many times over."""

import numpy as np
from matplotlib import colormaps

from dav_gswt.inspect import scene
from dav_gswt.inspect.scene import ColourBar


def test_the_ends_of_a_bar_are_the_coolest_and_the_warmest_colour_and_beyond_them_it_is_clipped():
    found = scene.map_colours(np.array([2.0, 4.0, -9.0, 99.0, 3.0]), ColourBar("", 2.0, 4.0))
    cool, warm = (scene.to_bytes(np.array(colormaps["coolwarm"](x)[:3])) for x in (0, 255))
    np.testing.assert_array_equal(found[[0, 2]], [cool, cool])
    np.testing.assert_array_equal(found[[1, 3]], [warm, warm])
    assert np.ptp(found[4].astype(int)) < 10  # grey in the middle


def test_what_is_no_number_is_grey():
    np.testing.assert_array_equal(
        scene.map_colours(np.array([np.nan, np.inf]), ColourBar("", 0.0, 1.0)), [scene.UNKNOWN] * 2
    )


def test_a_bar_of_a_constant_or_of_nothing_is_one_wide():
    assert scene.make_bar("a", np.full(3, 7.0)) == ColourBar("a", 7.0, 8.0)
    assert scene.make_bar("a", np.array([np.nan])) == ColourBar("a", 0.0, 1.0)


def test_balls_stand_at_their_places_and_keep_their_colours():
    at, tint = np.array([[0.0, 0, 0], [5.0, 0, 0]]), np.uint8([[1, 2, 3], [4, 5, 6]])
    layer = scene.make_balls(at, 0.5, tint)
    corners = layer.points[layer.cells].mean(1)
    nearest = np.linalg.norm(corners[:, None] - at, axis=2).argmin(1)
    np.testing.assert_array_equal(layer.colours, tint[nearest])
    distance = np.linalg.norm(layer.points[:, None] - at, axis=2).min(1)
    np.testing.assert_allclose(distance, 0.5, atol=1e-6)
