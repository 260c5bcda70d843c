"""What a field has over a ground: discs, their underlay, their constraints in a fit, and what is seen of them."""

from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.field import concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.raster import render
from dav_gswt.reconstruction import discs, top_view
from dav_gswt.reconstruction.coarse import estimate_uncertainty
from dav_gswt.reconstruction.fitting import state
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs


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


def test_the_underlay_lies_under_the_lowest_disc_around_and_misplaced_things_are_lost():
    """Above the ceiling, under the ground, off the grid."""
    grid, constraints, now = start([[1.6, 1.6, 0.3], [1.6, 1.6, 0.7], [1.6, 1.6, -0.5], [9.0, 1.6, 0.3]])
    misplaced = constraints.find_misplaced(now.values)
    np.testing.assert_array_equal(misplaced[constraints.fixed :], [False, True, True, True])
    assert not misplaced[: constraints.fixed].any()
    now.values["means"][5, 2] = -0.3
    constraints.project_parameters(now.values)
    low = now.values["means"][constraints.discs : constraints.fixed]
    near = np.abs(low[:, :2] - grid.centres[5, :2]).max(1) < 1.01 * grid.spacing
    assert near.any() and (low[near, 2] < -0.3).all()
    assert low[~near, 2].max() < 0


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
