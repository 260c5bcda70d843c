"""Far ground: rings on the surface about the eye, what rays meet of them, and haze."""

import numpy as np
import pytest
from fixtures.terrains import SKY, walking

from dav_gswt.terrain import stills
from dav_gswt.terrain.far_ground import HAZE, SPACING, FarColours, FarGround
from dav_gswt.terrain.heights import HeightMap, Hills

GROUND, HORIZON = np.float32([0.2, 0.5, 0.3]), np.float32([0.9, 0.8, 0.7])
COLOURS = FarColours(GROUND, HORIZON, 40.0, None)
HILLS = Hills(6.0, 60.0, 3, 2)


def rays(azimuths, falls):
    """Directions by tangents of the angle below the level."""
    azimuth, fall = np.meshgrid(azimuths, falls)
    return np.stack([np.cos(azimuth), np.sin(azimuth), -fall], -1)


def test_level_ground_fades_with_the_distance_that_a_ray_goes():
    eye, surface = np.array([7.0, -3.0, 5.0]), HeightMap(np.full((2, 2), 3.0, np.float32), 10.0)
    azimuths, falls = np.linspace(-4, 4, 31), 2 / np.array([45.0, 70.0, 150.0, 400.0])  # two units above the ground
    seen = FarGround.around(eye, surface, COLOURS).paint(rays(azimuths, falls), np.zeros((4, 31, 3), np.float32))
    left = np.exp(-np.hypot(1 / falls, 1) * 2 / (HAZE * 40))[:, None, None]
    # colours are linear from ring to ring: (0.05 d / 2.5 end)^2 / 8 of their change at the most
    np.testing.assert_allclose(seen, HORIZON + (GROUND - HORIZON) * left + 0 * seen, atol=0.001)


def test_rays_meet_the_hills_that_they_march_into():
    eye = np.array([11.0, 4.0, 0.0])
    eye[2] = HILLS.at(eye[:1], eye[1:2])[0][0] + 1.5
    to = rays(np.linspace(0, 6, 40), np.linspace(-0.05, 0.02, 60)).reshape(-1, 3)
    behind = np.full(to.shape, 7, np.float32)
    seen = FarGround.around(eye, HILLS, COLOURS).paint(to, behind)
    distance = 40 * np.geomspace(0.5, 12.5, 4000)
    x, y, z = (eye[k] + np.multiply.outer(to[:, k], distance) for k in range(3))
    height, _ = HILLS.smooth_at(x.ravel(), y.ravel(), np.tile(SPACING * distance, len(to)))
    below = height.reshape(z.shape) > z
    meets = below.any(1) & ~below[:, 0]  # from the first ring on
    assert 0.2 < meets.mean() < 0.8
    assert ((seen[:, 0] < 7) == meets)[~below[:, 0]].mean() > 0.98, "all but rays that graze a crest"
    hit = meets & (seen[:, 0] < 7)
    expected = COLOURS.at(distance[below[hit].argmax(1)], np.zeros((hit.sum(), 2)))
    # where one does not graze: neighbouring rings differ by at most 0.0525 / e of 0.7
    assert np.quantile(np.abs(seen[hit] - expected), 0.9) < 0.0135


@pytest.mark.parametrize("height", [1.0, 6.0, 30.0])
def test_ground_has_the_colour_of_the_horizon_there(hilly, height):
    backdrop = stills.Backdrop.for_eye(hilly, walking(hilly, 0.0, height).centre, SKY, GROUND)
    azimuths = np.linspace(0, 6, 90)
    above, below = (backdrop.colours_along(rays(azimuths, np.array([fall]))) for fall in (-1e-6, 1e-6))
    np.testing.assert_allclose(below, above, atol=0.01)  # exp(-5) of the ground is left at the last ring
    down = backdrop.colours_along(np.array([[0.0, 0.0, -1.0]]))
    assert np.abs(down - GROUND).max() < np.abs(down - above[0, 0]).max(), "it is ground that is seen from above"
