"""The ground of a scene: its place, its surface, its file, and what photos see of it through all that is between."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import coarse, discs, ground, photo_colours

FRAME = scene_frame(exemplar=(0.0, 0.0, 8.0), extent=(-2.0, -1.0, 10.0, 9.0))


def place(frame=FRAME, spacing=0.1, max_cells=10**6, margin=0.25):
    return ground.fit_ground(frame, np.zeros((0, 3)), spacing, max_cells, 32, margin)


@pytest.fixture
def flat():
    return place()


def test_the_exemplar_is_whole_cells_inside_the_well_seen_square_and_the_margin_ends_where_no_photo_sees(flat):
    west, south, side = flat.exemplar
    assert flat.cells == 64 and not flat.heights.any()
    assert side == pytest.approx(6.4)
    assert west >= 0 and south >= 0 and west + side <= 8 + 1e-9 and south + side <= 8 + 1e-9
    grid = place(margin=1.0)
    rows, columns = grid.shape
    assert grid.west >= -2 - 1e-9 and grid.west + columns * grid.spacing <= 10 + 1e-9
    assert grid.south >= -1 - 1e-9 and grid.south + rows * grid.spacing <= 9 + 1e-9


def test_the_cap_widens_the_spacing_and_an_exemplar_too_small_for_the_levels_is_refused():
    grid = place(spacing=0.01, max_cells=10_000)
    assert grid.heights.size <= 10_000 and grid.spacing > 0.01
    with pytest.raises(InputError, match="fewer levels"):
        place(spacing=1.0)


def test_a_tilted_plane_is_met_exactly_even_where_no_point_lies(flat):
    rng = np.random.default_rng(0)
    xy = rng.uniform([0, 0], [8, 4], (400, 2))  # the southern half alone
    points = np.column_stack([xy, 0.5 + 0.1 * xy[:, 0] - 0.05 * xy[:, 1]])
    heights = ground.fit_surface(flat, points)
    x, y = flat.centres[:, 0], flat.centres[:, 1]
    # a plane has no bending energy, so only the ridge of 1e-9 and the knots' half-cell offset speak against it
    np.testing.assert_allclose(heights.ravel(), 0.5 + 0.1 * x - 0.05 * y, atol=0.03)


def test_points_that_stand_out_do_not_lift_the_ground(flat):
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, 8, (2000, 2)), rng.normal(0, 0.005, 2000)])
    points[::20, 2] += 3.0
    assert np.abs(ground.fit_surface(flat, points)).max() < 0.05


def test_a_cells_height_is_that_at_its_centre_and_comes_back_from_an_exr_with_north_on_top(tmp_path, flat):
    hilly = replace(flat, heights=np.random.default_rng(0).normal(size=flat.shape))
    np.testing.assert_allclose(hilly.height_at(hilly.centres), hilly.heights.ravel(), atol=1e-9)
    ground.write_ground(hilly, tmp_path / "g.exr")
    back = ground.read_ground(tmp_path / "g.exr")
    np.testing.assert_array_equal(back.heights, hilly.heights.astype(np.float32))
    assert (back.west, back.spacing, back.cells) == (hilly.west, hilly.spacing, hilly.cells)
    channels, _ = image_files.read_exr(tmp_path / "g.exr")
    assert channels["Z"][0, 0] == np.float32(hilly.heights[-1, 0])


def test_the_surface_under_a_finished_field_is_found_and_what_lies_beyond_is_cut_off():
    frame = scene_frame(kind="field", flying_height=5.0, exemplar=(0.0, 0.0, 4.0), extent=(0.0, 0.0, 4.0, 4.0))
    xy, n = np.random.default_rng(0).uniform(-1, 5, (30_000, 2)), 30_000
    field = GaussianField(
        np.column_stack([xy, 0.3 + 0.1 * xy[:, 0]]).astype(np.float32),
        np.full((n, 3), np.log(0.05), np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, 3.0, np.float32),
        rgb_to_sh(np.full((n, 3), 0.5)),
        np.zeros(n, np.float32),
        np.ones(n, bool),  # as if it came from a ground layer of ours
    )
    inside, grid = coarse.prepare_external_field(field, frame, 20_000)
    assert 0 < len(inside) < n and not inside.ground.any()
    assert inside.means[:, :2].min() >= 0 and inside.means[:, :2].max() <= 4
    x = grid.centres[:, 0].reshape(grid.shape)
    # the topmost of overlapping round Gaussians is seen, up to a standard deviation above the surface
    assert np.abs(grid.heights - (0.3 + 0.1 * x)).max() < 0.06
    assert grid.spacing == pytest.approx(0.05 / discs.WIDTH)


def around(heights=None):
    """4 x 4 units from (-2, -2)."""
    flat = np.zeros((40, 40)) if heights is None else heights
    return ground.Ground(-2.0, -2.0, 0.1, 0, 0, 40, flat, np.ones((40, 40), bool))


def photo(eye, at=(0.0, 0.0, 0.0), weight=1.0):
    camera = cameras.pinhole(list(eye), list(at), 64, 64, 80.0)
    blank = np.zeros((64, 64, 3), np.float32)
    return TrainingView("photo", camera, blank, np.full((64, 64), weight, np.float32))


def eastings(grid):
    return grid.centres[:, 0].reshape(grid.shape).astype(np.float32)


def one(places, *photos, heights=None, values=None, least=1):
    grid = around(heights)
    values = eastings(grid) if values is None else values
    return photo_colours.median_behind(grid, values, np.asarray(places, np.float32), list(photos), least)


def test_behind_a_place_is_where_the_ray_through_it_meets_the_ground():
    # from (0, 0, 4) through (.5, 0, 2): 4 units down when twice as far from the eye
    found = one([[0.5, 0.0, 2.0], [0.0, 0.7, 1.0]], photo((0, 0.01, 4)))
    np.testing.assert_allclose(found, [1.0, 0.0], atol=0.06)  # half a cell and a little
    assert one(np.zeros((0, 3)), photo((0, 0.01, 4))).shape == (0,)
    # from (-1, 0, 3) along (1, 0, -1.5): meets a slope z = x / 4 where 3 - 1.5 (x + 1) = x / 4
    found = one([[0.0, 0.0, 1.5]], photo((-1, 0.01, 3)), heights=0.25 * eastings(around()))
    np.testing.assert_allclose(found, 1.5 / 1.75, atol=0.07)


def test_where_no_ground_is_seen_there_is_no_value():
    """The ray rises, or leaves the ground; the place is behind the camera; the pixel does not count."""
    found = [one([[0, 0, 3.5]], photo((0, 1.5, 3)))]
    found += [one([place], photo((0, 0.01, 4))) for place in ((1.5, 0, 2), (0, 0, 5))]
    found += [one([(0.5, 0, 2)], photo((0, 0.01, 4), weight=0.0))]
    np.testing.assert_array_equal(found, np.full((4, 1), np.nan))
