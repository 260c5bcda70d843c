"""Directional coverage: what photos show of the ground, what further ones add, and how wrong the field is where."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.geometry import cameras
from dav_gswt.geometry.scene_frame import Extent
from dav_gswt.reconstruction import ground
from dav_gswt.views import coverage
from dav_gswt.views.greedy import lazy_greedy


@pytest.fixture(scope="module")
def cells():
    return coverage.GroundCells(patch.field(), patch.grid())


def look(x, y, z, at=(1.6, 1.6, 0.0), size=64):
    return cameras.pinhole([x, y, z], list(at), size, size, 40.0)


def gain(cells, taken, one, importance=None):
    return cover(cells, taken, [one], importance).gain(0)


def cover(cells, taken, candidates, importance=None):
    return coverage.DirectionalCoverage(cells, cells.view(taken), cells.view(candidates), importance)


def count_pixels(cells, camera):
    return cells.view([camera]).pixels[0]


def test_pixels_of_a_picture_are_shared_among_the_cells_it_shows(cells):
    inside = count_pixels(cells, look(1.6, 1.7, 3.0))
    assert inside.sum() == pytest.approx(64 * 64, rel=0.03)
    corner = count_pixels(cells, look(0.4, 0.5, 1.0, (0.4, 0.4, 0.0))).reshape(coverage.CELLS, -1)
    assert corner[:14, :14].sum() > 0.99 * corner.sum()


def test_the_middle_of_a_cell_is_where_its_gaussians_are(cells):
    side = 3.2 / coverage.CELLS
    x, y = cells.middle.reshape(coverage.CELLS, -1, 3)[3, 20, :2]
    assert abs(x - 20.5 * side) < side and abs(y - 3.5 * side) < side


def test_half_the_distance_shows_a_cell_in_four_times_the_pixels(cells):
    at = np.argmax(count_pixels(cells, look(1.6, 1.61, 1.5)))
    near, far = cells.view([look(1.6, 1.61, 1.5), look(1.6, 1.61, 3.0)]).pixels[:, at]
    assert near / far == pytest.approx(4, rel=0.1)


def test_a_photo_from_another_side_adds_more_than_one_from_the_same(cells):
    first, again, other = look(3.6, 1.6, 2.0), look(3.6, 1.7, 2.0), look(-0.4, 1.6, 2.0)
    assert gain(cells, [first], other) > 1.5 * gain(cells, [first], again)


def test_gains_only_fall_and_a_photo_that_shows_nothing_gains_nothing(cells):
    away = cameras.pinhole([0.0, 0.0, 2.0], [0.0, 0.0, 9.0], 64, 64, 40.0)
    pool = [look(3.6, 1.6, 2.0), look(0.0, 0.0, 2.0), look(1.6, 3.0, 1.0), away]
    covered = cover(cells, [], pool)
    before = covered.gains()
    covered.take(0)
    after = covered.gains()
    assert all(a < b for a, b in zip(after[:3], before[:3], strict=True))
    assert before[3] == after[3] == 0


def test_greedy_reaches_its_bound_of_the_best_set(cells):
    pool = [camera.resized(32, 32) for _, camera in patch.pool(8, 0.7)]

    def value(chosen):
        covered, total = cover(cells, [], pool), 0.0
        for i in chosen:
            total += covered.gain(i)
            covered.take(i)
        return total

    covered = cover(cells, [], pool)
    greedy = lazy_greedy(covered.gains(), covered.gain, covered.take, 3)
    best = max(value(chosen) for chosen in combinations(range(8), 3))
    assert (1 - 1 / np.e) * best <= value(greedy) <= best * (1 + 1e-9)
    assert value(greedy) == pytest.approx(value(greedy[::-1]))


def test_cells_that_matter_draw_photos(cells):
    west, east = look(0.5, 0.6, 1.0, (0.5, 0.5, 0.0)), look(2.7, 0.6, 1.0, (2.7, 0.5, 0.0))
    matters = np.where(cells.middle[:, 0] > 1.6, 5.0, 1.0)
    assert gain(cells, [], west) == pytest.approx(gain(cells, [], east), rel=0.1)
    assert gain(cells, [], east, matters) > 3 * gain(cells, [], west, matters)
    assert gain(cells, [], east, 1e-20 * matters) == pytest.approx(gain(cells, [], east, matters))
    assert gain(cells, [], east, 0 * matters) == pytest.approx(gain(cells, [], east))


def test_where_far_more_ground_is_fitted_than_the_exemplar_all_of_it_counts():
    whole = replace(patch.FRAME, extent=Extent(-3.2, 0.0, 6.4, 3.2))
    grid = ground.fit_ground(whole, np.zeros((0, 3)), 0.1, max_cells=10**6, block=32, margin=ground.WHOLE)
    cells = coverage.GroundCells(patch.field(replace(grid, seen=np.ones(grid.shape, bool))), grid)
    west, south, east, north = grid.judged
    assert east - west > 2 * (north - south) and cells.shape[1] == coverage.CELLS > 2 * cells.shape[0]
    assert (cells.middle[:, 0].min(), cells.middle[:, 0].max()) == pytest.approx((west, east), abs=0.4)


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf])
def test_an_importance_that_is_no_weight_is_refused(cells, bad):
    with pytest.raises(ValueError, match="importance"):
        cover(cells, [], [], np.full(coverage.CELLS**2, bad))


def test_the_error_of_a_cell_is_that_of_the_pixels_that_show_it(cells):
    """Photos of the field itself, but for a corner that is brighter by .2."""
    wrong = []
    for view in patch.photos(size=96):
        x, y = (view.camera.rays()[0] + view.camera.rays()[1] * 4.0)[..., :2].transpose(2, 0, 1)
        brighter = 0.2 * ((x < 1.2) & (y < 1.2) & (view.image.max(-1) < 0.8))
        wrong.append(replace(view, image=view.image + brighter[..., None].astype(np.float32)))
    error = coverage.measure_cell_errors(cells, wrong)
    corner = (cells.middle[:, :2] < 1.0).all(1)
    rest = (cells.middle[:, :2] > 1.4).any(1) & (error < error.max())
    assert np.median(error[corner]) == pytest.approx(0.04, rel=0.2) and np.median(error[rest]) < 1e-4


def test_cells_that_no_photo_shows_count_as_the_worst_and_masked_pixels_do_not_count(cells):
    view = patch.photos(1, size=96)[0]
    near = replace(view, camera=look(0.5, 0.6, 1.0, (0.5, 0.5, 0.0), 96), image=view.image * 0)
    error = coverage.measure_cell_errors(cells, [near])
    assert error[-1] == error.max() > 0
    assert (coverage.measure_cell_errors(cells, [replace(near, weight=0 * near.weight)]) == 0).all()
    assert (coverage.measure_cell_errors(cells, []) == 0).all()
