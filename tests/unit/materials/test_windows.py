"""Which windows of the ground are fitted, and what is cut from them."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.geometry import cameras
from dav_gswt.geometry.scene_frame import Square
from dav_gswt.materials import build, windows
from dav_gswt.materials.maps import sharpen_maps
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction.fitting.plan import FitSettings

SIDE = made.CELLS * made.SPACING
SETTINGS = FitSettings(fit_size=256, spacing=1.5, max_gaussians=20_000, steps=10)


def photo(x, y, height, size=256, picture=None):
    """A view from straight above a place."""
    camera = cameras.pinhole([x, y, height], [x, y + 1e-3, 0], size, size, 60.0)
    image = np.full((size, size, 3), 0.5, np.float32) if picture is None else picture(camera)
    return TrainingView(f"{x}_{y}", camera, image, np.ones((size, size), np.float32))


@pytest.fixture(scope="module")
def plan():
    return build.plan_ground(made.maps(), True)


@pytest.fixture(scope="module")
def views():
    return [photo(x, y, 8.0) for x in (3, 6, 9) for y in (3, 6, 9)]


def test_each_material_and_each_object_outside_has_a_window(plan, views):
    focus = windows.choose_windows(plan, views, SETTINGS)
    place, tiled = plan.maps.exemplar, [each for each in focus.windows if each.tiled]
    for own in plan.sources:
        best = max(own[cells_of(place, each.square)].sum() for each in tiled)
        assert best >= min(windows.MOST * own.sum(), build.MARGINAL * plan.tile_side**2) * 0.95
    for footprint in plan.classes.footprints:
        assert any(
            footprint.cells[cells_of(place, each.square)].sum() == footprint.cells.sum() for each in focus.windows
        )
    assert all(each.square.side >= min(SIDE, build.ROOM * plan.tile_side * place.spacing) - 2 for each in tiled)


def cells_of(place, square):
    first = [
        round((low - start) / place.spacing) for low, start in ((square.south, place.south), (square.west, place.west))
    ]
    return tuple(slice(k, k + round(square.side / place.spacing)) for k in first)


def test_a_material_and_objects_are_cut_from_fitted_windows(plan, tmp_path):
    field, grid = made.field(), made.grid()
    whole = build.FocusedFields([(field, grid)], [True], plan.maps)
    usual, found = build.find_materials(field, grid, 0), build.find_materials(field, grid, 0, None, whole)
    assert [each.info.name for each in found.materials] == [each.info.name for each in usual.materials]
    assert len(found.objects) == len(usual.objects) > 0
    for ours, theirs in zip(found.objects, usual.objects, strict=True):
        np.testing.assert_array_equal(ours.field.means, theirs.field.means)
    assert found.tile_side == pytest.approx(usual.tile_side)
    assert all(each.grid.cells == made.CELLS for each in found.materials)
    maps = replace(plan.maps, tilt=np.full((made.CELLS, made.CELLS), 30.0))
    focus = windows.Focus([windows.FitWindow(Square(0.0, 0.0, SIDE), True)], made.SPACING, 0.07)
    windows.write_windows(whole.windows, focus, maps, tmp_path / "w")
    read = windows.read_windows(tmp_path / "w")
    assert read.tiled == [True] and read.maps.exemplar == plan.maps.exemplar
    np.testing.assert_allclose(read.maps.colour, plan.maps.colour, atol=1e-6)
    np.testing.assert_array_equal(read.maps.known, plan.maps.known)
    np.testing.assert_allclose(read.maps.tilt, 30.0)
    np.testing.assert_array_equal(read.windows[0][0].means, field.means)


def test_what_lies_in_no_window_is_left_out(plan):
    field, grid = made.field(), made.grid()
    part = replace(grid, first_row=grid.first_row + 64, cells=64)  # the north-west: two shrubs are in it whole
    found = build.find_materials(field, grid, 0, None, build.FocusedFields([(field, part)], [True], plan.maps))
    assert len(found.objects) < len(plan.classes.footprints)
    assert found.materials[0].grid.cells == 64


def test_sharper_maps_have_the_colours_of_the_photos():
    field = made.field(shrubs=False)
    seen = [photo(6.4, 6.4, 12.0, 512, lambda camera: np.clip(render(field, camera).colour, 0, 1).astype(np.float32))]
    blurred = replace(made.maps(shrubs=False), colour=np.full((made.CELLS, made.CELLS, 3), 0.5))
    maps = sharpen_maps(blurred, seen, 192)
    assert maps.cells == 192 and maps.exemplar.spacing * 192 == pytest.approx(SIDE)
    corner = np.hypot(6.4, 6.4) - 0.05  # from below the photo to the middle of the last cell
    assert maps.tilt is not None and maps.tilt.max() == pytest.approx(np.degrees(np.arctan2(corner, 12.0)), abs=1.0)
    middle = np.s_[60:130, 60:130]
    wanted = np.where(maps_of_truth(192)[middle][..., None], made.GRASS, made.SAND)
    assert np.abs(maps.colour[middle] - wanted).mean() < 0.06


def maps_of_truth(cells):
    at = (np.arange(cells) * made.CELLS / cells).astype(int)
    return made.true_materials()[np.ix_(at, at)] == 1


def test_windows_take_the_uncertainty_of_the_draft_that_a_prior_scored(plan):
    """Half of the ground is uncertain by the prior; the windows' own is zero."""
    field, grid = made.field(shrubs=False), made.grid()
    east = field.means[:, 0] > SIDE / 2
    scored = replace(field, uncertainty=np.where(east, 0.8, 0.1).astype(np.float32))
    focused = build.FocusedFields([(field, grid)], [True], plan.maps)
    (own, _), *_ = windows.take_uncertainty(focused, scored, grid).windows
    inside = np.abs(field.means[:, 0] - SIDE / 2) > 3 * made.SPACING
    inside &= grid.contains(field.means) & field.ground
    np.testing.assert_allclose(own.uncertainty[inside], scored.uncertainty[inside], atol=0.05)
