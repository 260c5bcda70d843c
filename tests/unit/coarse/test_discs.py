from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dav_gswt import cameras, views
from dav_gswt.coarse import discs, exposure, ground

FRAME = {
    "exemplar": {"west": 0.0, "south": 0.0, "side": 4.0},
    "extent": {"west": 0.0, "south": 0.0, "east": 4.0, "north": 4.0},
}


@pytest.fixture
def grid():
    return ground.lay(FRAME, np.zeros((0, 3)), spacing=0.1, cap=10**6, block=8, margin=0.0)


def photo(colour, name="photo", eye=(2.0, 2, 6)):
    camera = cameras.pinhole(eye, [eye[0], eye[1], 0], 40, 40, 60.0)
    image = np.broadcast_to(np.asarray(colour, np.float32), (40, 40, 3)).copy()
    return views.View(name, camera, image, np.ones((40, 40), np.float32))


def test_a_discs_thin_axis_is_the_surfaces_normal():
    east, north = np.array([0.0, 0.5, -0.3]), np.array([0.0, 0.0, 0.7])
    turned = Rotation.from_quat(discs.quaternions(east, north), scalar_first=True).apply([0, 0, 1])
    normal = np.stack([-east, -north, np.ones(3)], 1)
    np.testing.assert_allclose(turned, normal / np.linalg.norm(normal, axis=1)[:, None], atol=1e-6)


def test_discs_lie_on_the_surface_and_unseen_ones_are_uncertain(grid):
    sloped = replace(grid, heights=0.2 * grid.centres[:, 0].reshape(grid.shape))
    sloped.seen[:5] = True
    field = discs.ground_discs(sloped, np.full((grid.heights.size, 3), 0.5))
    np.testing.assert_allclose(field.means[:, 2], 0.2 * field.means[:, 0], atol=1e-6)
    assert field.ground.all()
    np.testing.assert_array_equal(field.uncertainty == 0, sloped.seen.ravel())


def test_the_median_ignores_one_photo_that_differs(grid):
    three = [photo([0.2, 0.3, 0.4]), photo([0.2, 0.3, 0.4]), photo([0.9, 0.9, 0.9])]
    colours, known = discs.median_colours(grid.centres, three)
    assert known.any()
    np.testing.assert_allclose(colours[known], np.tile([0.2, 0.3, 0.4], (known.sum(), 1)), atol=1e-6)
    assert np.isnan(colours[~known]).all()


def test_the_median_of_two_photos_is_their_mean(grid):
    colours, known = discs.median_colours(grid.centres, [photo([0.2, 0.2, 0.2]), photo([0.4, 0.4, 0.4])])
    np.testing.assert_allclose(colours[known], 0.3, atol=1e-6)


def test_unknown_cells_take_their_neighbours_colours():
    known = np.zeros((4, 6), bool)
    known[:, :3] = True
    colours = np.full((24, 3), np.nan, np.float32)
    colours[known.ravel()] = 0.25
    np.testing.assert_allclose(discs.filled(colours, known), 0.25, atol=1e-6)


def test_only_points_that_stand_above_the_surface_and_within_the_band_are_things(grid):
    points = np.array([[1.0, 1, 0.05], [1, 1, 0.5], [1, 1, 3.0], [1, 1, -1.0], [9, 9, 0.5]])
    field = discs.things(grid, points, np.full((5, 3), 0.5), band=1.0)
    np.testing.assert_allclose(field.means, [[1, 1, 0.5]])
    assert not field.ground.any()


def test_exposures_are_levelled_without_drift(grid):
    rng = np.random.default_rng(0)
    texture = rng.uniform(0.2, 0.7, (40, 40, 3)).astype(np.float32)
    gains = [0.8, 1.0, 1.0, 1.25]
    photos = [replace(photo([0, 0, 0], str(g)), image=(texture * g).astype(np.float32)) for g in gains]
    levelled = exposure.levelled(photos, grid.centres)
    for view in levelled:
        np.testing.assert_allclose(view.image.mean((0, 1)), texture.mean((0, 1)), rtol=0.02)
