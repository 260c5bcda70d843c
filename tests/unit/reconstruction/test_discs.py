from dataclasses import replace

import numpy as np
import pytest
from fixtures.frames import scene_frame
from scipy.spatial.transform import Rotation

from dav_gswt.reconstruction import discs, ground

FRAME = scene_frame(exemplar=(0.0, 0.0, 4.0), extent=(0.0, 0.0, 4.0, 4.0))


@pytest.fixture
def grid():
    return ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=8, margin=0.0)


def test_a_discs_thin_axis_is_the_surfaces_normal():
    east, north = np.array([0.0, 0.5, -0.3]), np.array([0.0, 0.0, 0.7])
    turned = Rotation.from_quat(discs.slopes_to_quaternions(east, north), scalar_first=True).apply([0, 0, 1])
    normal = np.stack([-east, -north, np.ones(3)], 1)
    np.testing.assert_allclose(turned, normal / np.linalg.norm(normal, axis=1)[:, None], atol=1e-6)


def test_discs_lie_on_the_surface_and_unseen_ones_are_uncertain(grid):
    sloped = replace(grid, heights=0.2 * grid.centres[:, 0].reshape(grid.shape))
    sloped.seen[:5] = True
    field = discs.make_ground_discs(sloped, np.full((grid.heights.size, 3), 0.5))
    np.testing.assert_allclose(field.means[:, 2], 0.2 * field.means[:, 0], atol=1e-6)
    assert field.ground.all()
    np.testing.assert_array_equal(field.uncertainty == 0, sloped.seen.ravel())


def test_unknown_cells_take_their_neighbours_colours():
    known = np.zeros((4, 6), bool)
    known[:, :3] = True
    colours = np.full((24, 3), np.nan, np.float32)
    colours[known.ravel()] = 0.25
    np.testing.assert_allclose(discs.fill_unknown(colours, known), 0.25, atol=1e-6)
