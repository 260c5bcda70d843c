"""Places on earth against pyproj, and the sun over them against published ones."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest
from pyproj import Transformer

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
