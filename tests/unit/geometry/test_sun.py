"""The sun's place against published ones."""

from datetime import UTC, datetime, timedelta, timezone

import pytest

from dav_gswt.geometry.sun import locate_sun

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
