"""Cameras, places on earth against pyproj, and the sun over them against published ones."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest
from pyproj import Transformer

from dav_gswt.geometry import camera_layouts, cameras
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.sun import locate_sun


def test_what_goes_to_the_earth_comes_back():
    points = np.random.default_rng(0).uniform(-1500, 1500, (50, 3))
    for latitude in (-89.0, -30.0, 0.0, 60.0):
        place = Georeference(latitude, -179.9999, 300.0, 211.0, 1.7)
        np.testing.assert_allclose(place.to_world(place.to_earth(points)), points, atol=1e-6)


@pytest.mark.parametrize("latitude, longitude", [(47.1, 11.3), (-33.0, -70.2)])
def test_metres_from_the_earths_centre_are_those_of_pyproj(latitude, longitude):
    place = Georeference(latitude, longitude, 610.0, 25.0, 3.5)
    points = np.random.default_rng(4).uniform(-500, 500, (20, 3))
    found = np.concatenate([points, np.ones((20, 1))], 1) @ place.to_geocentric.T
    project = Transformer.from_crs("EPSG:4979", "EPSG:4978")
    np.testing.assert_allclose(found[:, :3], np.stack(project.transform(*place.to_earth(points).T), 1), atol=1e-6)
    np.testing.assert_array_equal(found[:, 3], 1)


WITHIN = 0.01  # degrees, that the formula claims, which leaves out 0.002 of parallax


def test_the_sun_stands_where_the_example_of_nrels_algorithm_has_it():
    """Reda and Andreas, Solar Position Algorithm (2004), appendix A.5, without refraction."""
    time = datetime(2003, 10, 17, 12, 30, 30, tzinfo=timezone(timedelta(hours=-7)))
    assert locate_sun(time, 39.742476, -105.1786) == pytest.approx((39.872046, 194.340241), abs=WITHIN)


@pytest.mark.parametrize(("latitude", "elevation", "azimuth"), [(40.0, 42.21493, 180), (-40.0, 57.78507, 0)])
def test_at_noon_the_sun_is_highest_and_stands_towards_the_equator(latitude, elevation, azimuth):
    """Meeus, Astronomical Algorithms, 25.a and 28.b: declination -7.78507, equation of time 3.427351 degrees."""
    found = locate_sun(datetime(1992, 10, 13, tzinfo=UTC), latitude, 180 - 3.427351)
    assert found[0] == pytest.approx(elevation, abs=WITHIN)
    assert (found[1] - azimuth + 180) % 360 - 180 == pytest.approx(0, abs=WITHIN)


def test_a_pinhole_sees_its_target_in_the_middle_and_up_is_up():
    camera = cameras.pinhole([3.0, 0, 4], [0, 0, 0], 100, 80, 60.0)
    pixels, depth = camera.project(np.array([[0.0, 0, 0], [0, 0, 0.5]]))
    np.testing.assert_allclose(pixels[0], [50, 40], atol=1e-9)
    assert depth[0] == pytest.approx(5)
    assert pixels[1, 1] < 40  # higher in the world is higher in the picture: rows grow downwards


def test_a_map_camera_puts_north_up_and_one_cell_on_one_pixel():
    camera = cameras.top_down(west=10.0, south=20.0, width=4, height=3, cell=0.5, top=7.0)
    south_west, north_east = np.array([[10.25, 20.25, 0], [11.75, 21.25, 5]])
    pixels, depth = camera.project(np.stack([south_west, north_east]))
    np.testing.assert_allclose(pixels, [[0.5, 2.5], [3.5, 0.5]])
    np.testing.assert_allclose(depth, [7, 2])


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_point_on_a_pixels_ray_projects_to_that_pixel(orthographic):
    made = cameras.pinhole([1.0, -2, 3], [0.3, 0.1, 0], 7, 5, 50.0)
    camera = cameras.Camera(**(vars(made) | {"orthographic": orthographic}))
    origin, step = camera.rays()
    pixels, depth = camera.project((origin + 2.5 * step).reshape(-1, 3))
    x, y = np.meshgrid(np.arange(7) + 0.5, np.arange(5) + 0.5)
    np.testing.assert_allclose(pixels, np.stack([x.ravel(), y.ravel()], 1), atol=1e-9)
    np.testing.assert_allclose(depth, 2.5)


def camera(elevation, azimuth, radius=7.0, target=(1.0, 2.0, 0.5)):
    return camera_layouts.orbit(elevation, azimuth, radius, target, 60, 40, 90.0)
