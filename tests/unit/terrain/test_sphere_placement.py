"""Pictures of planets: no holes, also at edges, corners and far out; the plane as the limit; the sky."""

from dataclasses import replace

import numpy as np
import pytest
from dav_gswt.terrain.ground_mapping import camera_on, mapping_of
from dav_gswt.terrain.sphere_placement import place_on_sphere
from fixtures.terrains import MAGENTA, SIDE, SKY, two_level_terrain

from dav_gswt.bundle.manifest import Sky
from dav_gswt.errors import InputError
from dav_gswt.terrain import finite, stills
from dav_gswt.terrain.backdrop import Backdrop
from dav_gswt.terrain.sphere import frame_at, make_sphere

PINK = Sky(MAGENTA, MAGENTA)


@pytest.fixture(scope="module")
def tiles():
    return replace(two_level_terrain(), reach=48)


def camera_over(terrain, point, height, pitch, yaw=20.0):
    up = np.array(point) / np.linalg.norm(point)
    axes = frame_at(*np.degrees([np.arctan2(up[1], up[0]), np.arcsin(up[2])]))
    return camera_on((terrain.heights.radius + height) * axes[2], axes, yaw, pitch, 64, 36)


def through(picture):
    """How much magenta shows: green is a half in tiles and 0 behind them."""
    return np.clip(1 - picture[..., 1] / 0.5, 0, 1)


@pytest.mark.parametrize(
    "radius, point, height, pitch",
    [
        pytest.param(8.0, (1, 1, 1), 6.0, -89.0, id="corner"),
        pytest.param(300.0, (1, 0.2, 1), 1.0, -60.0, id="turned edge"),
        pytest.param(8.0, (1, 1, 0.2), 1.0, -60.0, id="edge"),
        pytest.param(1e6, (0, 0, 1), 1.0, -60.0, id="pole"),
    ],
)
def test_the_ground_has_no_holes(tiles, radius, point, height, pitch):
    planet = replace(tiles, heights=make_sphere(radius, SIDE))
    picture = stills.render_view(planet, camera_over(planet, point, height, pitch), PINK, MAGENTA)
    assert through(picture).max() < 0.1  # opaque discs' deviation is 0.7 of their spacing, stretched to 1.26


def test_a_large_sphere_is_the_plane(tiles):
    """Over the middle of a face, with sides as wide as the plane's: radius 1e6 tiles bends 4 tiles by 1e-5 of one."""
    ball = make_sphere(1e6, SIDE)
    odd = replace(ball, cells=2 * (ball.cells // 2) + 1, radius=(2 * (ball.cells // 2) + 1) * SIDE * 2 / np.pi)
    planet = replace(tiles, heights=odd)
    axes = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    eye = np.array([odd.radius + 2.0, 0, 0])
    cells = mapping_of(planet).find_cells(camera_on(eye, axes, 90.0, -89.9, 64, 36))
    middle = np.flatnonzero(cells.close & (cells.nearest < 1))[:1]
    field, jacobian = place_on_sphere(planet, odd, cells[middle], eye)
    np.testing.assert_allclose(jacobian, np.broadcast_to(axes.T, jacobian.shape), atol=1e-5)
    flat = planet.tiles[0, int(cells.tile[middle][0])]
    seen = field.means.astype(float) @ axes.T + [0, 0, 2.0]
    seen[:, :2] -= np.round((seen - [0, 0, 0])[:, :2].mean(0) / SIDE) * SIDE - 0.5 * SIDE
    first, second = (np.sort(values[:, 0] + 7 * values[:, 1]) for values in (seen, flat.means.astype(float)))
    np.testing.assert_allclose(first, second, atol=1e-3)


def backdrop_on(terrain, radius, height):
    planet = replace(terrain, heights=make_sphere(radius, SIDE))
    eye = np.array([0.0, 0.0, planet.heights.radius + height])
    return mapping_of(planet).make_backdrop(eye, SKY, [0.4, 0.3, 0.2])


def test_far_out_the_sky_is_that_of_the_plane(tiles):
    way = np.random.default_rng(2).normal(size=(50, 3))
    flat = Backdrop.for_eye(tiles, np.array([0.0, 0.0, 2.0]), SKY, [0.4, 0.3, 0.2])
    # the horizon lies 3e-4 lower
    np.testing.assert_allclose(backdrop_on(tiles, 1e7, 2.0).colours_along(way), flat.colours_along(way), atol=0.02)


@pytest.mark.parametrize("height", [1e-3, 1.0, 1e9])
def test_the_backdrop_is_finite_and_dark_far_away(tiles, height):
    backdrop = backdrop_on(tiles, 8.0, height)
    colours = backdrop.colours_along(np.random.default_rng(1).normal(size=(200, 3)))
    assert np.isfinite(colours).all() and colours.min() >= 0 and colours.max() <= 1
    assert (backdrop.colours_along(np.array([[0.0, 0.0, 1.0]])).max() < 1e-3) == (height > 100)


def test_no_rectangle_is_cut_from_a_sphere(tiles):
    planet = replace(tiles, heights=make_sphere(8.0, SIDE))
    with pytest.raises(InputError, match="plane"):
        finite.list_cells(planet, 0, 0, 2, 2)
