from dataclasses import replace

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import Extent
from dav_gswt.reconstruction import ground

FRAME = scene_frame(exemplar=(0.0, 0.0, 8.0), extent=(-2.0, -1.0, 10.0, 9.0))


def test_the_exemplar_is_a_block_of_whole_cells_inside_the_well_seen_square():
    grid = ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=32, margin=0.25)
    west, south, side = grid.exemplar
    assert grid.cells == 64
    assert side == pytest.approx(6.4)
    assert west >= 0 and south >= 0 and west + side <= 8 + 1e-9 and south + side <= 8 + 1e-9


def test_the_margin_ends_where_no_photo_sees():
    grid = ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=32, margin=1.0)
    rows, columns = grid.shape
    assert grid.west >= -2 - 1e-9 and grid.west + columns * grid.spacing <= 10 + 1e-9
    assert grid.south >= -1 - 1e-9 and grid.south + rows * grid.spacing <= 9 + 1e-9


def test_judged_is_the_exemplar_unless_far_more_is_modelled():
    usual = ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=32, margin=ground.MARGIN)
    west, south, side = usual.exemplar
    assert usual.judged == pytest.approx((west, south, west + side, south + side))
    wide = replace(FRAME, extent=Extent(-20.0, 0.0, 10.0, 9.0))
    whole = ground.fit_ground(wide, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=32, margin=ground.WHOLE)
    west, south, side = whole.exemplar
    rows, columns = whole.shape
    assert whole.judged[0] == pytest.approx(whole.west + ground.MARGIN * side)
    assert whole.judged[1] == pytest.approx(south) and whole.judged[3] >= south + side
    assert whole.judged[2] <= whole.west + columns * whole.spacing


def test_the_cap_widens_the_spacing():
    grid = ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.01, max_cells=10_000, block=32, margin=0.25)
    assert grid.heights.size <= 10_000
    assert grid.spacing > 0.01


def test_an_exemplar_too_small_for_the_levels_says_what_to_do():
    with pytest.raises(InputError, match="fewer levels"):
        ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=1.0, max_cells=10**6, block=32, margin=0.25)


@pytest.fixture
def flat():
    return ground.fit_ground(FRAME, np.zeros((0, 3)), spacing=0.1, max_cells=10**6, block=32, margin=0.25)


def test_without_points_the_ground_is_flat(flat):
    assert not flat.heights.any()


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


def test_height_at_a_cells_centre_is_the_cells_height(flat):
    from dataclasses import replace

    hilly = replace(flat, heights=np.random.default_rng(0).normal(size=flat.shape))
    np.testing.assert_allclose(hilly.height_at(hilly.centres), hilly.heights.ravel(), atol=1e-9)


def test_a_ground_comes_back_from_its_exr_with_north_on_top(tmp_path, flat):
    from dataclasses import replace

    from dav_gswt.images import image_files

    hilly = replace(flat, heights=np.arange(flat.heights.size, dtype=float).reshape(flat.shape))
    ground.write_ground(hilly, tmp_path / "g.exr")
    back = ground.read_ground(tmp_path / "g.exr")
    np.testing.assert_array_equal(back.heights, hilly.heights.astype(np.float32))
    assert (back.west, back.spacing, back.cells) == (hilly.west, hilly.spacing, hilly.cells)
    channels, _ = image_files.read_exr(tmp_path / "g.exr")
    assert channels["Z"][0, 0] == hilly.heights[-1, 0]
