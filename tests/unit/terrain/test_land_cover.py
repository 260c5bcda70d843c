"""Terrains of several materials: whole ground, counts, and cells of one material as without the others."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import GRASS, SAND, SIDE, TILES, cover_content
from fixtures.terrains import SKY, walking

from dav_gswt.bundle.build import BundleOptions, describe_tiles
from dav_gswt.bundle.orders import DirectionRings
from dav_gswt.terrain import endless, placement, stills, visibility

MAGENTA = [1.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def content():
    return replace(cover_content(), objects=[], scatter=None, probabilities=[])


@pytest.fixture(scope="module")
def cover(content):
    info = describe_tiles(content, BundleOptions(tau=0.5, salt=7), DirectionRings((20.0,), 8))
    fields = [content.tile_fields(level) for level in range(content.levels)]
    return replace(endless.terrain_from_fields(fields, info, {"kind": "flat"}), reach=10)


@pytest.fixture(scope="module")
def sand(cover):
    """The same terrain with nothing but sand."""
    tiles = {(level, tile): field for (level, tile), field in cover.tiles.items() if tile < TILES}
    return replace(cover, tiles=tiles, classes=None)


def straight_down(terrain, height):
    return stills.shot_camera(stills.Shot("down", (0.3, 0.2), height, 90.0, 90.0), terrain, 1.0, 96, 96)


def test_there_are_borders_and_cells_of_each_material(cover):
    i, j = (v.ravel() for v in np.mgrid[0:40, 0:40].astype(np.int64))
    assert {1, 2, 3} == set(cover.classes.materials_in(i, j).tolist())


def test_no_sky_shows_through_where_materials_meet(cover):
    camera = straight_down(cover, 12.0)
    assert 3 in visibility.visible_cells(cover, camera).materials
    image = stills.render_view(cover, camera, SKY, MAGENTA)
    alone = stills.render_view(replace(cover, classes=None), camera, SKY, MAGENTA)  # its first material's tiles
    # magenta would raise blue above green
    assert (image[..., 2] - image[..., 1]).max() <= (alone[..., 2] - alone[..., 1]).max() + 0.02


def test_the_picture_shows_both_materials_side_by_side(cover):
    image = stills.render_view(cover, straight_down(cover, 14.0), SKY, MAGENTA)
    redder = image[..., 0] > image[..., 1]
    share = redder.mean()
    assert 0.2 < share < 0.8
    assert image[redder].mean(0) == pytest.approx(SAND, abs=0.08)
    assert image[~redder].mean(0) == pytest.approx(GRASS, abs=0.08)


def test_a_cell_of_one_material_is_placed_as_without_the_others(cover, sand):
    camera = walking(cover)
    cells = visibility.visible_cells(cover, camera)
    pure, alone = np.flatnonzero(cells.materials == 1), replace(cells, materials=np.ones(len(cells), int))
    for k in pure[:5]:
        field, slope = placement.place_cell(cover, cells[k : k + 1], camera.centre)
        same, own = placement.place_cell(sand, alone[k : k + 1], camera.centre)
        np.testing.assert_array_equal(field.means, same.means)
        np.testing.assert_array_equal(field.opacity_logits, same.opacity_logits)
        np.testing.assert_array_equal(slope, own)


def test_a_border_cell_keeps_gaussians_of_both_in_one_order(cover):
    camera = walking(cover)
    cells = visibility.visible_cells(cover, camera)
    k = int(np.flatnonzero((cells.materials == 3) & ~cells.close)[0])
    tiles = placement.collect_tiles(cover, cells[k : k + 1], [0])
    counts = visibility.count_gaussians(cover, cells[k : k + 1])
    assert 0.9 * len(cover.tiles[0, 0]) < len(tiles[0]) < counts[0] or counts[0] == 0
    green = tiles[0].base_colours[:, 1] > tiles[0].base_colours[:, 0]
    assert green.any() and not green.all()


def test_a_budget_counts_the_tiles_of_all_materials_in_a_cell(cover):
    cells = visibility.visible_cells(cover, walking(cover))
    pure = replace(cells, materials=np.ones(len(cells), int), tile=cells.tile % TILES)
    both = replace(pure, materials=np.full(len(cells), 3))
    grass = replace(pure, materials=np.full(len(cells), 2), tile=cells.tile % TILES + TILES)
    counts = [visibility.count_gaussians(cover, each) for each in (pure, grass, both)]
    np.testing.assert_array_equal(counts[0] + counts[1], counts[2])


def test_kept_gaussians_are_those_of_the_first_time(cover):
    camera = walking(cover)
    cells = visibility.visible_cells(cover, camera)
    k = int(np.flatnonzero(cells.materials == 3)[0])
    first, again = (placement.place_cell(cover, cells[k : k + 1], camera.centre)[0].means for _ in range(2))
    np.testing.assert_array_equal(first, again)
    fresh = placement.place_cell(replace(cover), cells[k : k + 1], camera.centre)[0].means
    np.testing.assert_array_equal(first, fresh)


def test_a_cell_is_placed_the_same_when_what_was_remembered_is_forgotten(cover, monkeypatch):
    camera = walking(cover)
    cells = visibility.visible_cells(cover, camera)
    k = int(np.flatnonzero(cells.materials == 3)[0])
    first = placement.place_cell(cover, cells[k : k + 1], camera.centre)[0].means
    del cover.kept[next(place for place in cover.kept if place[:2] == (cells.i[k], cells.j[k]))]
    monkeypatch.setattr(placement, "KEPT", 0)
    again = placement.place_cell(cover, cells[k : k + 1], camera.centre)[0].means
    np.testing.assert_array_equal(first, again)


def test_a_million_tiles_out_the_cover_is_the_same_function(cover):
    far = [1_000_000, 1_000_001]
    masks = cover.classes.materials_in(np.array(far), np.array([-1_000_000] * 2))
    places = np.array([[0.5 * SIDE, 0.5 * SIDE, 0.0]], np.float32)
    for i, mask in zip(far, masks.tolist(), strict=True):
        kept = [bool(cover.classes.keep(i, -1_000_000, places, np.array([m]))[0]) for m in (0, 1)]
        assert sum(kept) == 1
        assert all(mask >> m & 1 for m in (0, 1) if kept[m])
