import numpy as np
from fixtures import ground as made

from dav_gswt.field import concatenate_fields
from dav_gswt.reconstruction.discs import slopes_to_quaternions
from dav_gswt.reconstruction.fitting import state
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs


def start(points):
    grid = made.grid()
    things = make_blobs(
        np.asarray(points, float).reshape(-1, 3), np.full((len(points), 3), 0.5), np.full(len(points), 0.1)
    )
    return (
        grid,
        GroundConstraints(grid, np.full(grid.shape, 0.5)),
        state.from_field(concatenate_fields([made.field(), things])),
    )


def test_discs_keep_to_their_cells_and_turn_with_the_surface():
    grid, constraints, now = start([])
    rng = np.random.default_rng(0)
    n = constraints.discs
    now.values["means"][:n] += rng.normal(0, 0.2, (n, 3)).astype(np.float32)
    constraints.project_parameters(now.values)
    assert np.abs(now.values["means"][:n, :2] - grid.centres[:, :2]).max() <= 0.49 * grid.spacing + 1e-6
    turned = slopes_to_quaternions(*(s.ravel() for s in constraints.surface(now.values).slopes()))
    assert np.abs(turned[:, 1:]).max() > 0.3
    np.testing.assert_array_equal(now.values["quats"][:n], turned)


def test_the_underlay_lies_under_the_lowest_disc_around():
    grid, constraints, now = start([])
    now.values["means"][5, 2] = -0.3
    constraints.project_parameters(now.values)
    low = now.values["means"][constraints.discs : constraints.fixed]
    near = np.abs(low[:, :2] - grid.centres[5, :2]).max(1) < 1.01 * grid.spacing
    assert near.any() and (low[near, 2] < -0.3).all()
    assert low[~near, 2].max() < 0


def test_things_above_the_ceiling_under_the_ground_or_off_the_grid_are_lost():
    _, constraints, now = start([[1.6, 1.6, 0.3], [1.6, 1.6, 0.7], [1.6, 1.6, -0.5], [9.0, 1.6, 0.3]])
    misplaced = constraints.find_misplaced(now.values)
    np.testing.assert_array_equal(misplaced[constraints.fixed :], [False, True, True, True])
    assert not misplaced[: constraints.fixed].any()


def test_no_thing_is_a_needle_and_flat_ones_are_welcome():
    _, constraints, now = start([[1.6, 1.6, 0.3], [1.6, 1.6, 0.3]])
    now.values["log_scales"][constraints.fixed :] = np.log([[0.1, 0.001, 0.001], [0.1, 0.1, 0.011]])
    constraints.project_parameters(now.values)
    sizes = np.sort(np.exp(now.values["log_scales"][constraints.fixed :]), 1)
    assert (sizes[:, 2] <= 3.001 * sizes[:, 1]).all()
    np.testing.assert_allclose(sizes[1], [0.011, 0.1, 0.1], rtol=1e-4)
