"""Stills: ground without cracks under sky, far ground in haze, draw order close to exact sorting, shots."""

import numpy as np
import pytest
from fixtures.terrains import MAGENTA, SKY, walking

from dav_gswt.bundle.manifest import Sky
from dav_gswt.terrain import stills
from dav_gswt.terrain.backdrop import SPACING, FarColours, FarGround
from dav_gswt.terrain.heights import Hills


@pytest.mark.parametrize("shot", stills.SHOTS, ids=lambda shot: shot.name)
def test_stills_have_ground_below_and_sky_above(terrain, hilly, shot):
    shown = hilly if shot.name == "oblique" else terrain
    camera = stills.shot_camera(shot, shown, 3.0, 64, 36)
    picture = stills.render_view(shown, camera, SKY, [0.45, 0.5, 0.3])
    assert picture.shape == (36, 64, 3) and np.isfinite(picture).all()
    np.testing.assert_allclose(picture[-4:, :, 1:], np.broadcast_to([0.5, 0.3], (4, 64, 2)), atol=0.03)
    if shot.pitch < 20:
        assert (picture[0, :, 2] > 0.6).all()


@pytest.mark.parametrize("pitch, height", [(12.0, 1.5), (45.0, 4.0)])
def test_hills_have_no_cracks(hilly, pitch, height):
    """Before magenta: where a ray meets the ground nothing shines through, neither at tile borders nor where levels
    change."""
    camera = walking(hilly, pitch, height, at=(3.4, -2.3))
    picture = stills.render_view(hilly, camera, Sky(MAGENTA, MAGENTA), MAGENTA)
    origin, step = (a.reshape(-1, 3) for a in camera.rays())
    t = np.linspace(0.5, 20, 400)  # nearer than where tiles go over into what is behind them
    at = origin[:, None] + t[:, None] * step[:, None]
    ground_at = hilly.heights.at(at[..., 0].ravel(), at[..., 1].ravel())[0].reshape(len(origin), -1)
    # only rays that go well below the surface: a pixel at a hill's rim is half sky
    meets = (at[..., 2] < ground_at - 0.5).any(1).reshape(picture.shape[:2])
    assert meets.mean() > 0.5
    # blue is at most .3 on tiles, 1 in magenta; discs of opacity .98 at .72 spacings let less than 1 % through
    assert (picture[meets][:, 2] - 0.3).max() / 0.7 < 0.02


def test_tile_by_tile_is_nearly_the_exactly_sorted_picture(stony):
    camera = walking(stony, 20.0, 3.0, size=(96, 54))
    page, exact = (stills.render_view(stony, camera, SKY, [0.4, 0.5, 0.3], exact) for exact in (False, True))
    error = np.mean((page - exact) ** 2)
    assert 0 < error < 10**-3  # above 30 dB where four tiles show, each with a hundred stones
    above = walking(stony, 89.99, 2.0, at=(1.5, 1.5))
    np.testing.assert_array_equal(*(stills.render_view(stony, above, SKY, MAGENTA, exact) for exact in (False, True)))


GROUND, HORIZON = np.float32([0.2, 0.5, 0.3]), np.float32([0.9, 0.8, 0.7])
COLOURS = FarColours(GROUND, HORIZON, 40.0, None)
HILLS = Hills(6.0, 60.0, 3, 2)


def rays(azimuths, falls):
    """Directions by tangents of the angle below the level."""
    azimuth, fall = np.meshgrid(azimuths, falls)
    return np.stack([np.cos(azimuth), np.sin(azimuth), -fall], -1)


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
