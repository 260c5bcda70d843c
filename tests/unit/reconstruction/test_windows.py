"""Windows of the ground that are fitted by themselves, with the draft around them held fixed."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import Square
from dav_gswt.reconstruction import windows
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.windows import Draft, FitWindow

SETTINGS = FitSettings(fit_size=96, spacing=1.0, max_gaussians=4000, steps=40)
WINDOW = FitWindow(Square(0.8, 0.8, 1.6), tiled=True)
COARSE = made.grid(0.1)


@pytest.fixture(scope="module")
def fitted():
    blurred = replace(made.field(COARSE), sh=0 * made.field(COARSE).sh)
    draft = Draft(blurred, COARSE, replace(made.FRAME, kind="synthetic"))
    found = windows.fit_windows(draft, made.photos(4, 96), [WINDOW], 0.05, SETTINGS, np.random.default_rng(0))
    return draft, found[0][1]


def test_a_window_lies_in_its_square_in_whole_blocks_with_a_margin_and_the_heights_of_the_draft():
    sloped = replace(COARSE, heights=0.1 * COARSE.centres[:, 0].reshape(COARSE.shape))
    grid = windows.make_grid(sloped, WINDOW, 0.05)
    west, south, side = grid.exemplar
    assert grid.cells == 32 and side == pytest.approx(1.6) and (west, south) == pytest.approx((0.8, 0.8))
    assert grid.first_row == grid.first_column == int(windows.MARGIN * COARSE.spacing / 0.05)
    np.testing.assert_allclose(grid.heights.ravel(), 0.1 * grid.centres[:, 0], atol=0.02)
    assert windows.make_grid(sloped, replace(WINDOW, tiled=False), 0.047).cells == 34
    corner = windows.make_grid(sloped, FitWindow(Square(0.0, 0.0, 1.6), True), 0.05)
    assert corner.first_row == corner.first_column == 0 and corner.west == pytest.approx(0)


def test_the_whole_square_is_looked_at_where_the_drafts_blocks_leave_a_part_of_it():
    grid = made.grid(0.07)  # 45 cells, of which 32 are the draft's exemplar, in the middle of the square
    wide = replace(grid, heights=np.zeros((45, 45)), seen=np.ones((45, 45), bool), west=0.02, south=0.02)
    wide = windows.widen_exemplar(replace(wide, first_row=6, first_column=6), Square(0.0, 0.0, 3.2))
    assert (wide.first_row, wide.first_column, wide.cells) == (0, 0, 45)
    assert windows.widen_exemplar(grid, Square(1.0, 1.0, 0.5)) == grid


def test_a_window_shows_the_photos_and_its_field_has_none_of_what_surrounds_it(fitted):
    draft, own = fitted
    grid, field = own.grid, own.field
    assert grid.spacing == pytest.approx(0.05) and field.ground.sum() == grid.heights.size
    assert grid.contains(field.means).all()
    inside = windows.find_inside(grid, field) & field.ground
    away = np.abs(field.base_colours - made.look(*field.means[:, :2].T))[inside].max(1)
    assert np.median(away) < 0.05 < np.abs(0.5 - made.look(*field.means[:, :2].T))[inside].max(1).mean()


def test_a_joined_field_is_the_window_inside_and_the_draft_outside(fitted):
    draft, own = fitted
    joined = windows.join_windows(draft, [own])
    within = windows.find_inside(own.grid, joined)
    assert within.sum() == windows.find_inside(own.grid, own.field).sum()
    outside = draft.field[~windows.find_inside(own.grid, draft.field)]
    np.testing.assert_array_equal(joined.means[~within], outside.means)
    np.testing.assert_array_equal(joined.sh[~within], outside.sh)


def test_masks_count_where_a_view_looks_at_a_square():
    view = made.photos(1)[0]
    masked = windows.mask_to_squares([view], [(0.0, 0.0, 3.2), (10.0, 10.0, 1.0)])[0]
    away = windows.mask_to_squares([view], [(10.0, 10.0, 1.0)])[0]
    assert 0.3 < masked.weight.mean() <= 1 and not away.weight.any()


def test_an_objects_window_that_no_photo_shows_is_left_out_and_one_for_tiles_is_an_error():
    draft = Draft(made.field(COARSE), COARSE, replace(made.FRAME, kind="synthetic"))
    blind = [view.with_pixels(weight=0 * view.weight) for view in made.photos(2)]
    thing = replace(WINDOW, tiled=False)
    assert windows.fit_windows(draft, blind, [thing], 0.05, SETTINGS, np.random.default_rng(0)) == []
    with pytest.raises(InputError, match="no photo shows the ground"):
        windows.fit_windows(draft, blind, [WINDOW], 0.05, SETTINGS, np.random.default_rng(0))
