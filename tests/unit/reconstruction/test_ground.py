"""The ground of a scene: its place, its surface, its file; what a field has over it, and what is seen of that."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.raster import render
from dav_gswt.reconstruction import coarse, discs, ground, top_view
from dav_gswt.reconstruction.coarse import estimate_uncertainty
from dav_gswt.reconstruction.fitting import state
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs

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
    with pytest.raises(InputError, match="fewer `levels`"):
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


def test_discs_lie_on_the_surface_unseen_ones_are_uncertain_and_unknown_ones_take_their_neighbours_colours():
    grid = replace(made.grid(), seen=np.zeros(made.grid().shape, bool))
    sloped = replace(grid, heights=0.2 * grid.centres[:, 0].reshape(grid.shape))
    sloped.seen[:5] = True
    field = discs.make_ground_discs(sloped, np.full((grid.heights.size, 3), 0.5))
    np.testing.assert_allclose(field.means[:, 2], 0.2 * field.means[:, 0], atol=1e-6)
    assert field.ground.all()
    np.testing.assert_array_equal(field.uncertainty == 0, sloped.seen.ravel())
    known = np.zeros((4, 6), bool)
    known[:, :3] = True
    colours = np.full((24, 3), np.nan, np.float32)
    colours[known.ravel()] = 0.25
    np.testing.assert_allclose(discs.fill_unknown(colours, known), 0.25, atol=1e-6)


def test_no_sky_shines_through_the_ground_between_shrunken_discs():
    grid, field = made.grid(), made.field()
    scales = field.log_scales.copy()
    scales[: grid.heights.size, :2] = np.log(0.2 * grid.spacing)
    grains = replace(field, log_scales=scales)
    camera = cameras.pinhole([1.6, 0.0, 0.8], [1.6, 1.6, 0], 96, 96, 40.0)
    blank = TrainingView("", camera, np.zeros((96, 96, 3), np.float32), np.ones((96, 96), np.float32))
    counts = mask_outside_ground(blank, 0.4, 0.4, 2.8, 2.8).weight > 0
    assert render(discs.remove_underlay(grains, grid), camera).alpha[counts].min() < 0.5  # there were holes
    assert render(grains, camera).alpha[counts].min() > 0.95


def start(points):
    grid, places = made.grid(), np.asarray(points, float).reshape(-1, 3)
    things = make_blobs(places, np.full((len(points), 3), 0.5), np.full(len(points), 0.1))
    now = state.from_field(concatenate_fields([made.field(), things]))
    return grid, GroundConstraints(grid, np.full(grid.shape, 0.5)), now


def test_discs_keep_to_their_cells_and_turn_with_the_surface_and_no_thing_is_a_needle():
    grid, constraints, now = start([[1.6, 1.6, 0.3], [1.6, 1.6, 0.3]])
    now.values["log_scales"][constraints.fixed :] = np.log([[0.1, 0.001, 0.001], [0.1, 0.1, 0.011]])
    rng = np.random.default_rng(0)
    n = constraints.discs
    now.values["means"][:n] += rng.normal(0, 0.2, (n, 3)).astype(np.float32)
    constraints.project_parameters(now.values)
    assert np.abs(now.values["means"][:n, :2] - grid.centres[:, :2]).max() <= 0.49 * grid.spacing + 1e-6
    turned = discs.slopes_to_quaternions(*(s.ravel() for s in constraints.surface(now.values).slopes()))
    assert np.abs(turned[:, 1:]).max() > 0.3
    np.testing.assert_array_equal(now.values["quats"][:n], turned)
    sizes = np.sort(np.exp(now.values["log_scales"][constraints.fixed :]), 1)
    assert (sizes[:, 2] <= 3.001 * sizes[:, 1]).all()
    np.testing.assert_allclose(sizes[1], [0.011, 0.1, 0.1], rtol=1e-4)  # flat ones are welcome


def test_a_map_from_above_has_the_south_in_its_first_row():
    grid = made.grid()
    found = top_view.render_top_view(made.field(grid), grid)
    true = made.look(*grid.centres[:, :2].T).reshape(*grid.shape, 3)
    inner = np.s_[3:-3, 3:-3]
    # coplanar discs are blended by their index, which moves the picture by a part of a cell
    assert np.abs(found.colour[inner] - true[inner]).mean() < 0.02
    assert np.abs(found.colour[::-1][inner] - true[inner]).mean() > 0.05
    np.testing.assert_allclose(found.height[inner], 0, atol=2e-3)


def test_ground_that_no_photo_sees_is_uncertain_and_the_rest_is_not():
    photos = [replace(photo, weight=photo.weight.copy()) for photo in made.photos(1)]
    photos[0].weight[:, :24] = 0
    field = estimate_uncertainty(made.field(), photos)
    field = field[field.ground]
    pixels, _ = photos[0].camera.project(field.means.astype(float))
    inside = (pixels > 2).all(1) & (pixels < 46).all(1)
    assert field.uncertainty[inside & (pixels[:, 0] > 27)].max() < 0.1
    assert field.uncertainty[inside & (pixels[:, 0] < 21)].min() == 1
