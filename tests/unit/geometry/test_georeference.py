import numpy as np
import pytest
from pyproj import Transformer

from dav_gswt.geometry.georeference import Georeference


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
