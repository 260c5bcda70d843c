"""Stills: ground without cracks under sky, draw order close to exact sorting, fades without jumps, shots."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from fixtures.terrains import MAGENTA, SKY, terrain_of, walking
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Sky
from dav_gswt.geometry import cameras
from dav_gswt.terrain import draw_order, placement, stills, visibility
from dav_gswt.terrain.choice import tile_at
from dav_gswt.terrain.timing import FrameTiming


def test_no_gaussian_in_the_picture_is_lost_with_its_cell(hilly):
    """Against all cells around: the picture is the same, whatever is culled."""
    camera = walking(hilly, 40.0, 2.0)
    everywhere = replace(hilly, z=(-1e3, 1e3), overhang=1e3)
    pictures = [stills.render_view(t, camera, SKY, MAGENTA) for t in (hilly, everywhere)]
    np.testing.assert_array_equal(*pictures)


def test_a_level_that_equals_its_neighbour_lets_nothing_more_through(stony):
    """Every Gaussian stands beside its twin in the merged order, and at its peak both hide as much as it did alone."""
    twice = {(level, t): stony.tiles[0, t] for level in (0, 1) for t in range(16)}
    faded = terrain_of(twice, [12.0, np.inf], [8.0, 0.0])
    camera = walking(stony, 40.0)
    black = Sky([0.0] * 3, [0.0] * 3)
    alone, both = (stills.render_view(t, camera, black, [0.0] * 3) for t in (stony, faded))
    through = [stills.render_view(t, camera, SKY, MAGENTA) - p for t, p in ((stony, alone), (faded, both))]
    assert through[1].max() < through[0].max() + 0.01
    # on its flanks a pair hides more than one does, (1 - o_w g)(1 - o_v g) < 1 - o g, so soft things look fuller
    assert np.abs(alone - both).mean() < 0.015


def test_a_place_is_the_same_on_every_visit_and_far_out_too(terrain):
    """2^32 cells out the hash repeats, and 2^34 units are exact in float64: the same picture to the bit."""
    home = walking(terrain, 30.0)
    out = cameras.pinhole(home.centre + [2.0**34, -(2.0**34), 0], home.centre, 64, 36, 60.0)
    out = replace(out, rotation=home.rotation, translation=-home.rotation @ (home.centre + [2.0**34, -(2.0**34), 0]))
    pictures = [stills.render_view(terrain, camera, SKY, MAGENTA) for camera in (home, out)]
    # the camera's own centre is a product of numbers of 2^34, good to 1e-6 units
    np.testing.assert_allclose(*pictures, atol=2e-3)
    cells = visibility.visible_cells(terrain, out)
    (k,) = np.flatnonzero((cells.i == 2**32) & (cells.j == -(2**32)))
    corner = np.array([2.0**34, -(2.0**34), 0])
    field, _ = placement.place_cell(terrain, cells[k : k + 1], corner)
    here = terrain.tiles[0, tile_at(0, 0, 7, 1)]
    assert sorted(map(tuple, field.means.tolist())) == sorted(map(tuple, here.means.tolist()))


def test_a_picture_of_too_many_gaussians_is_coarser_and_has_no_less_ground(terrain, monkeypatch):
    above = cameras.pinhole(np.array([1.0, 2, 15]), np.array([1.0, 2.001, 0]), 48, 48, 60.0)
    count = visibility.count_gaussians(terrain, visibility.visible_cells(terrain, above)).sum()
    monkeypatch.setattr(stills, "MAX_GAUSSIANS", int(count // 3))
    picture = stills.render_view(terrain, above, SKY, MAGENTA)
    assert np.abs(picture - MAGENTA).sum(-1).min() > 0.3


@pytest.mark.parametrize("shot", stills.SHOTS, ids=lambda shot: shot.name)
@pytest.mark.parametrize("surface", ["terrain", "hilly"])
def test_stills_have_ground_below_and_sky_above(request, surface, shot):
    shown = request.getfixturevalue(surface)
    camera = stills.shot_camera(shot, shown, 3.0, 96, 54)
    picture = stills.render_view(shown, camera, SKY, [0.45, 0.5, 0.3])
    assert picture.shape == (54, 96, 3)
    assert np.isfinite(picture).all()
    np.testing.assert_allclose(picture[-4:, :, 1:], np.broadcast_to([0.5, 0.3], (4, 96, 2)), atol=0.03)
    if shot.pitch < 20 and surface == "terrain":
        assert (picture[0, :, 2] > 0.6).all()


@pytest.mark.parametrize("pitch, height", [(12.0, 1.5), (45.0, 4.0), (89.0, 15.0)])
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
    camera = walking(stony, 20.0, 3.0, size=(160, 90))
    page, exact = (stills.render_view(stony, camera, SKY, [0.4, 0.5, 0.3], exact) for exact in (False, True))
    error = np.mean((page - exact) ** 2)
    assert 0 < error < 10**-3  # above 30 dB where four tiles show, each with a hundred stones
    above = walking(stony, 89.99, 2.0, at=(1.5, 1.5))
    np.testing.assert_array_equal(*(stills.render_view(stony, above, SKY, MAGENTA, exact) for exact in (False, True)))


@dataclass(frozen=True)
class Plane:
    """Rises to the east by one in one."""

    low: float = -1e3
    high: float = 1e3
    steepest: float = 1.0

    def at(self, x: Float[Array, "n"], y: Float[Array, "n"]) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
        return x.copy(), np.tile([1.0, 0.0], (len(x), 1))


def test_a_slope_takes_the_order_of_its_slope(stony, monkeypatch):
    """From above, a slope of one in one is seen as level ground is from 45 degrees: uphill stones come first."""
    steep = replace(stony, heights=Plane())
    camera = walking(steep, 89.0, 25.0, size=(160, 90))
    exact = stills.render_view(steep, camera, SKY, MAGENTA, exact=True)
    errors = [np.mean((stills.render_view(steep, camera, SKY, MAGENTA) - exact) ** 2)]
    level = draw_order.nearest_order
    monkeypatch.setattr(draw_order, "nearest_order", lambda along, kept, to, slope: level(along, kept, to, 0 * slope))
    errors.append(np.mean((stills.render_view(steep, camera, SKY, MAGENTA) - exact) ** 2))
    assert errors[0] < 0.7 * errors[1]


def test_a_slow_walk_never_jumps_where_levels_change(terrain):
    """Steps of a twentieth of the band: a fade changes a little of every pixel, a switch all of some."""
    plain = {(level, t): terrain.tiles[level, 5] for level in (0, 1) for t in range(16)}
    plain = {key: replace(f, sh=f.sh + np.float32(key[0])) for key, f in plain.items()}  # levels differ much in colour
    changes = []
    for band in (2.0, 0.0):
        faded = replace(terrain, tiles=plain, bands=[band, 0.0])
        shots = [walking(faded, 45.0, 14.0, at=(0.5 + 0.05 * k, 0.5), size=(48, 27)) for k in range(4)]
        walk = np.stack([stills.render_view(faded, shot, SKY, [0.4, 0.5, 0.3]) for shot in shots])
        changes.append(np.abs(np.diff(walk, axis=0)).max())
    assert changes[0] < 0.7 * changes[1]


def test_a_flight_goes_straight_on_at_one_height_over_hills(hilly):
    shots = stills.walk_shots(5, 8.0, 2.0)
    eyes = np.array([stills.shot_camera(shot, hilly, 3.0, 64, 36).centre for shot in shots])
    assert [shot.name for shot in shots] == ["0000", "0001", "0002", "0003", "0004"]
    np.testing.assert_allclose(np.diff(eyes[:, :2], axis=0), [[4, 4 * 3**0.5]] * 4, atol=1e-9)
    np.testing.assert_allclose(eyes[:, 2] - hilly.heights.at(*eyes[:, :2].T)[0], 6.0, atol=1e-9)


def test_a_camera_without_an_eye_is_refused(terrain):
    with pytest.raises(ValueError, match="pinhole"):
        stills.render_view(terrain, cameras.top_down(0.0, 0.0, 8, 8, 1.0, 5.0), SKY, MAGENTA)


def test_a_picture_is_the_same_measured_or_not_and_coarser_within_a_budget(terrain):
    camera, whole, least = walking(terrain), FrameTiming(), FrameTiming()
    plain, timed = (stills.render_view(terrain, camera, SKY, MAGENTA, timing=timing) for timing in (None, whole))
    assert (plain == timed).all() and set(whole.milliseconds) == {"update", "sort", "render"}
    budget = 3 * whole.gaussians // 4  # the coarsest level alone has half
    stills.render_view(visibility.coarsen_to_budget(terrain, camera, budget), camera, SKY, MAGENTA, timing=least)
    assert whole.gaussians // 2 < least.gaussians <= budget
    assert visibility.coarsen_to_budget(terrain, camera, 10**6) is terrain
