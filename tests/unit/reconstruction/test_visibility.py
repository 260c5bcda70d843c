"""A photo that sees the ground sees through all that is between."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import visibility
from dav_gswt.reconstruction.ground import Ground

SIZE = 64


def ground(heights=None, cells=40):
    """4 x 4 units from (-2, -2)."""
    flat = np.zeros((cells, cells)) if heights is None else heights
    return Ground(-2.0, -2.0, 4.0 / cells, 0, 0, cells, flat, np.ones((cells, cells), bool))


def photo(eye, at=(0.0, 0.0, 0.0), weight=1.0):
    camera = cameras.pinhole(list(eye), list(at), SIZE, SIZE, 80.0)
    blank = np.zeros((SIZE, SIZE, 3), np.float32)
    return TrainingView("photo", camera, blank, np.full((SIZE, SIZE), weight, np.float32))


def eastings(grid):
    return grid.centres[:, 0].reshape(grid.shape).astype(np.float32)


def one(places, *photos, grid=None, values=None, least=1):
    grid = grid or ground()
    values = eastings(grid) if values is None else values
    return visibility.median_behind(grid, values, np.asarray(places, np.float32), list(photos), least)


def test_behind_a_place_is_where_the_ray_through_it_meets_the_ground():
    # from (0, 0, 4) through (.5, 0, 2): 4 units down when twice as far from the eye
    found = one([[0.5, 0.0, 2.0], [0.0, 0.7, 1.0]], photo((0, 0.01, 4)))
    np.testing.assert_allclose(found, [1.0, 0.0], atol=0.06)  # half a cell and a little


def test_a_slope_is_met_where_it_is():
    grid = ground()
    slope = replace(grid, heights=0.25 * grid.centres[:, 0].reshape(grid.shape))
    # from (-1, 0, 3) along (1, 0, -1.5): meets z = x / 4 where 3 - 1.5 (x + 1) = x / 4
    found = one([[0.0, 0.0, 1.5]], photo((-1, 0.01, 3)), grid=slope)
    np.testing.assert_allclose(found, 1.5 / 1.75, atol=0.07)


@pytest.mark.parametrize(
    "place, eye, weight",
    [
        pytest.param((0, 0, 3.5), (0, 1.5, 3), 1.0, id="the ray rises"),
        pytest.param((1.5, 0, 2), (0, 0.01, 4), 1.0, id="the ray leaves the ground"),
        pytest.param((0, 0, 5), (0, 0.01, 4), 1.0, id="behind the camera"),
        pytest.param((0.5, 0, 2), (0, 0.01, 4), 0.0, id="pixels that do not count"),
    ],
)
def test_where_no_ground_is_seen_there_is_no_value(place, eye, weight):
    assert np.isnan(one([place], photo(eye, weight=weight))).all()


def test_most_photos_decide_and_few_have_no_say():
    grid = ground()
    values = np.where(eastings(grid) > 0.5, np.float32(1), np.float32(0.2))
    values[eastings(grid) < -0.5] = np.nan
    west, middle, east = photo((-2, 0.01, 3)), photo((0, 0.01, 3)), photo((2, 0.01, 3))  # they see 1, .2 and nothing
    place = [[0.0, 0.0, 1.5]]

    def tell(*photos, least=1):
        return float(one(place, *photos, values=values, least=least)[0])

    assert tell(west) == 1 and tell(middle) == pytest.approx(0.2) and np.isnan(tell(east))
    assert tell(west, middle) == pytest.approx(0.6) and tell(west, middle, middle, east) == pytest.approx(0.2)
    assert tell(west, middle, east, least=2) == pytest.approx(0.6) and np.isnan(tell(west, middle, east, least=3))


def test_no_places_and_the_same_whatever_the_number_of_them():
    assert one(np.zeros((0, 3)), photo((0, 0.01, 4))).shape == (0,)
    places = np.random.default_rng(0).uniform([-1, -1, 0.1], [1, 1, 2], (50, 3)).astype(np.float32)
    photos = [photo((0, 0.01, 4)), photo((1, 1, 3)), photo((-1, 1, 3))]
    whole = one(places, *photos)
    np.testing.assert_array_equal(whole[:20], one(places[:20], *photos))
