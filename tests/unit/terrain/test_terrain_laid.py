"""The terrain as it is laid and drawn: what is in sight, levels that fade, hills without cracks, order and sorting."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from fixtures.frames import scene_frame
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle import orders
from dav_gswt.field import concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.reconstruction import discs, ground
from dav_gswt.terrain import assemble, order, still
from dav_gswt.terrain.choice import tile_at
from dav_gswt.terrain.heights import Hills
from dav_gswt.terrain.meter import Meter

SKY = {"zenith": [0.3, 0.5, 0.9], "horizon": [0.8, 0.85, 0.9]}
PINK = [1.0, 0.0, 1.0]
HILLS = Hills(8.0, 40.0, 3, 2)
SIDE = 4.0


def tile_of(number, spacing, stones=0):
    """A tile of discs of one colour and, if asked for, opaque stones that stand on it."""
    frame = scene_frame(exemplar=(0.0, 0.0, SIDE), extent=(0.0, 0.0, SIDE, SIDE))
    grid = ground.lay(frame, np.zeros((0, 3)), spacing, 10**6, block=16, margin=0.0)
    flat = discs.ground_discs(grid, np.tile([0.2 + number / 32, 0.5, 0.3], (grid.heights.size, 1)))
    if not stones:
        return flat
    rng = np.random.default_rng(number)
    some = flat[rng.choice(len(flat), stones, replace=False)]
    means = some.means + [0, 0, 0.25] * rng.uniform(0.2, 1, (stones, 1))
    colours = rng.normal(0, 0.8, some.sh.shape).astype(np.float32)
    scales = np.full((stones, 3), np.log(0.12), np.float32)
    return concatenate_fields([flat, replace(some, means=means.astype(np.float32), sh=colours, log_scales=scales)])


def terrain_of(tiles, switches=(20.0, np.inf), bands=(2.0, 0.0), **more):
    return assemble.Terrain(
        tiles=tiles,
        side=SIDE,
        switches=list(switches),
        bands=list(bands),
        directions=orders.Rings().directions(),
        kept=[[*range(0, 16, 2), 16]] * 16,
        z=(-0.2, 0.6),
        overhang=0.7,
        variants=1,
        salt=7,
        near=0.05,
        reach=12,
        **more,
    )


@pytest.fixture(scope="module")
def terrain():
    """Sixteen tiles of one colour each, 4 units wide, at two levels."""
    spacings = enumerate((0.125, 0.25))
    return terrain_of({(level, t): tile_of(t, spacing) for level, spacing in spacings for t in range(16)})


@pytest.fixture(scope="module")
def hilly(terrain):
    return replace(terrain, heights=HILLS)


@pytest.fixture(scope="module")
def stony():
    """One level, coarse discs and stones: what order is worth."""
    return terrain_of({(0, t): tile_of(t, 0.25, 40) for t in range(16)}, [np.inf], [0.0])


def walking(terrain, pitch=12.0, height=3.0, at=(0.5, 0.5), size=(64, 36)):
    return still.camera_of(still.Shot("here", at, height, pitch, 60.0), terrain, 1.0, *size)


def met_by_rays(surface, camera):
    """Cells whose ground a ray through some pixel meets: the slow way, in small steps along each."""
    origin, step = (a.reshape(-1, 3) for a in camera.rays())
    t = np.linspace(0.05, 60, 6000)
    met = set()
    for o, s in zip(origin, step, strict=True):
        at = o + t[:, None] * s
        under = np.flatnonzero(at[:, 2] < surface.at(at[:, 0], at[:, 1])[0])
        if len(under):
            met.add(tuple(np.floor(at[under[0], :2] / SIDE).astype(int).tolist()))
    return met


@pytest.mark.parametrize("pitch, height", [(12.0, 3.0), (-10.0, 1.0), (60.0, 1.0), (89.0, 9.0)])
@pytest.mark.parametrize("surface", ["terrain", "hilly"])
def test_what_the_camera_sees_is_there(request, surface, pitch, height):
    laid = request.getfixturevalue(surface)
    camera = walking(laid, pitch, height, size=(24, 14))
    cells = assemble.visible(laid, camera)
    assert met_by_rays(laid.heights, camera) <= set(zip(cells.i.tolist(), cells.j.tolist(), strict=True))


def test_what_is_out_of_sight_is_not_there(terrain):
    cells = assemble.visible(terrain, walking(terrain))
    assert len(cells) < 0.3 * (2 * terrain.reach + 1) ** 2
    ahead = np.array([np.cos(np.radians(60)), np.sin(np.radians(60))])
    middle = np.stack([cells.i + 0.5, cells.j + 0.5], 1) * SIDE - 2.0
    assert (middle @ ahead > -2 * SIDE).all()


def test_no_gaussian_in_the_picture_is_lost_with_its_cell(hilly):
    """Against all cells around: the picture is the same, whatever is culled."""
    camera = walking(hilly, 40.0, 2.0)
    everywhere = replace(hilly, z=(-1e3, 1e3), overhang=1e3)
    pictures = [still.draw(t, camera, SKY, PINK) for t in (hilly, everywhere)]
    np.testing.assert_array_equal(*pictures)


def test_cells_come_back_to_front_and_the_nearest_nine_are_marked(terrain):
    cells = assemble.visible(terrain, walking(terrain, 60.0, 9.0))
    steps = np.abs(cells.i) + np.abs(cells.j)
    assert (np.diff(steps) <= 0).all() and steps[-1] == 0
    assert set(zip(cells.i[cells.close].tolist(), cells.j[cells.close].tolist(), strict=True)) <= {
        (i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)
    }


def test_distances_bound_those_of_the_gaussians(hilly):
    camera = walking(hilly)
    cells = assemble.visible(hilly, camera)
    for k in range(0, len(cells), 37):
        field, _ = assemble.laid(hilly, cells[k : k + 1], camera.centre)
        distance = np.linalg.norm(field.means.astype(float), axis=1)
        assert cells.nearest[k] <= distance.min() + 1e-4 and distance.max() <= cells.farthest[k] + 1e-4


def test_levels_follow_the_distance(terrain):
    camera = walking(terrain)
    cells = assemble.visible(terrain, camera)
    levels = assemble.active(terrain, cells)
    assert (levels[0] == (cells.nearest <= 22)).all() and (levels[1] == (cells.farthest >= 18)).all()
    assert (levels.all(0)).any() and levels.any(0).all()


def test_each_gaussian_fades_by_its_own_distance(terrain):
    camera = walking(terrain)
    cells = assemble.visible(terrain, camera)
    k = int(np.flatnonzero(assemble.active(terrain, cells).all(0))[0])
    field, _ = assemble.laid(terrain, cells[k : k + 1], camera.centre)
    fine = field.log_scales[:, 0] < np.log(0.13)
    distance = np.linalg.norm(field.means.astype(float), axis=1)
    opacity = 1 / (1 + np.exp(-field.opacity_logits.astype(float)))
    share = np.clip(0.5 - (distance - 20) / 4, 0, 1)
    whole = 1 / (1 + np.exp(-discs.OPAQUE))
    np.testing.assert_allclose(opacity, 1 - (1 - whole) ** np.where(fine, share, 1 - share), atol=1e-5)
    assert fine.any() and not fine.all() and (opacity > 0).all()


def test_a_level_that_equals_its_neighbour_lets_nothing_more_through(stony):
    """Every Gaussian stands beside its twin in the merged order, and at its peak both hide as much as it did alone."""
    twice = {(level, t): stony.tiles[0, t] for level in (0, 1) for t in range(16)}
    faded = terrain_of(twice, [12.0, np.inf], [8.0, 0.0])
    camera = walking(stony, 40.0)
    black = {"zenith": [0.0] * 3, "horizon": [0.0] * 3}
    alone, both = (still.draw(t, camera, black, [0.0] * 3) for t in (stony, faded))
    through = [still.draw(t, camera, SKY, PINK) - p for t, p in ((stony, alone), (faded, both))]
    assert through[1].max() < through[0].max() + 0.01
    # on its flanks a pair hides more than one does, (1 - o_w g)(1 - o_v g) < 1 - o g, so soft things look fuller
    assert np.abs(alone - both).mean() < 0.015


def test_a_place_is_the_same_on_every_visit_and_far_out_too(terrain):
    """2^32 cells out the hash repeats, and 2^34 units are exact in float64: the same picture to the bit."""
    home = walking(terrain, 30.0)
    out = cameras.pinhole(home.centre + [2.0**34, -(2.0**34), 0], home.centre, 64, 36, 60.0)
    out = replace(out, rotation=home.rotation, translation=-home.rotation @ (home.centre + [2.0**34, -(2.0**34), 0]))
    pictures = [still.draw(terrain, camera, SKY, PINK) for camera in (home, out)]
    # the camera's own centre is a product of numbers of 2^34, good to 1e-6 units
    np.testing.assert_allclose(*pictures, atol=2e-3)
    cells = assemble.visible(terrain, out)
    (k,) = np.flatnonzero((cells.i == 2**32) & (cells.j == -(2**32)))
    corner = np.array([2.0**34, -(2.0**34), 0])
    field, _ = assemble.laid(terrain, cells[k : k + 1], corner)
    here = terrain.tiles[0, tile_at(0, 0, 7, 1)]
    assert sorted(map(tuple, field.means.tolist())) == sorted(map(tuple, here.means.tolist()))


def test_too_many_gaussians_go_farthest_first(terrain):
    cells = assemble.visible(terrain, walking(terrain))
    few = assemble.within_budget(terrain, cells, 20_000)
    assert 0 < len(few) < len(cells)
    gone = ~np.isin(cells.i * 1000 + cells.j, few.i * 1000 + few.j)
    assert few.nearest.max() <= cells.nearest[gone].min()
    assert (np.diff(np.abs(few.i) + np.abs(few.j)) <= 0).all(), "and the order stays"


def test_a_picture_of_too_many_gaussians_is_coarser_and_has_no_less_ground(terrain, monkeypatch):
    above = cameras.pinhole(np.array([1.0, 2, 15]), np.array([1.0, 2.001, 0]), 48, 48, 60.0)
    count = assemble.sizes(terrain, assemble.visible(terrain, above)).sum()
    monkeypatch.setattr(still, "MOST", int(count // 3))
    picture = still.draw(terrain, above, SKY, PINK)
    assert np.abs(picture - PINK).sum(-1).min() > 0.3


@pytest.mark.parametrize("shot", still.SHOTS, ids=lambda shot: shot.name)
@pytest.mark.parametrize("surface", ["terrain", "hilly"])
def test_stills_have_ground_below_and_sky_above(request, surface, shot):
    laid = request.getfixturevalue(surface)
    camera = still.camera_of(shot, laid, 3.0, 96, 54)
    picture = still.draw(laid, camera, SKY, [0.45, 0.5, 0.3])
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
    picture = still.draw(hilly, camera, {"zenith": PINK, "horizon": PINK}, PINK)
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
    page, exact = (still.draw(stony, camera, SKY, [0.4, 0.5, 0.3], exact) for exact in (False, True))
    error = np.mean((page - exact) ** 2)
    assert 0 < error < 10**-3  # above 30 dB where four tiles show, each with a hundred stones
    above = walking(stony, 89.99, 2.0, at=(1.5, 1.5))
    np.testing.assert_array_equal(*(still.draw(stony, above, SKY, PINK, exact) for exact in (False, True)))


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
    exact = still.draw(steep, camera, SKY, PINK, exact=True)
    errors = [np.mean((still.draw(steep, camera, SKY, PINK) - exact) ** 2)]
    level = order.nearest
    monkeypatch.setattr(order, "nearest", lambda along, kept, to, slope: level(along, kept, to, 0 * slope))
    errors.append(np.mean((still.draw(steep, camera, SKY, PINK) - exact) ** 2))
    assert errors[0] < 0.7 * errors[1]


def test_a_slow_walk_never_jumps_where_levels_change(terrain):
    """Steps of a twentieth of the band: a fade changes a little of every pixel, a switch all of some."""
    plain = {(level, t): terrain.tiles[level, 5] for level in (0, 1) for t in range(16)}
    plain = {key: replace(f, sh=f.sh + np.float32(key[0])) for key, f in plain.items()}  # levels differ much in colour
    changes = []
    for band in (2.0, 0.0):
        laid = replace(terrain, tiles=plain, bands=[band, 0.0])
        shots = [walking(laid, 45.0, 14.0, at=(0.5 + 0.05 * k, 0.5), size=(48, 27)) for k in range(4)]
        walk = np.stack([still.draw(laid, shot, SKY, [0.4, 0.5, 0.3]) for shot in shots])
        changes.append(np.abs(np.diff(walk, axis=0)).max())
    assert changes[0] < 0.7 * changes[1]


def test_a_flight_goes_straight_on_at_one_height_over_hills(hilly):
    shots = still.flight(5, 8.0, 2.0)
    eyes = np.array([still.camera_of(shot, hilly, 3.0, 64, 36).centre for shot in shots])
    assert [shot.name for shot in shots] == ["0000", "0001", "0002", "0003", "0004"]
    np.testing.assert_allclose(np.diff(eyes[:, :2], axis=0), [[4, 4 * 3**0.5]] * 4, atol=1e-9)
    np.testing.assert_allclose(eyes[:, 2] - hilly.heights.at(*eyes[:, :2].T)[0], 6.0, atol=1e-9)


def test_a_camera_without_an_eye_is_refused(terrain):
    with pytest.raises(ValueError, match="pinhole"):
        still.draw(terrain, cameras.top_down(0.0, 0.0, 8, 8, 1.0, 5.0), SKY, PINK)


def test_a_picture_is_the_same_measured_or_not_and_coarser_within_a_budget(terrain):
    camera, whole, least = walking(terrain), Meter(), Meter()
    plain, told = (still.draw(terrain, camera, SKY, PINK, meter=meter) for meter in (None, whole))
    assert (plain == told).all() and set(whole.milliseconds) == {"update", "sort", "render"}
    budget = 3 * whole.gaussians // 4  # the coarsest level alone has half
    still.draw(assemble.coarsened(terrain, camera, budget), camera, SKY, PINK, meter=least)
    assert whole.gaussians // 2 < least.gaussians <= budget
    assert assemble.coarsened(terrain, camera, 10**6) is terrain
