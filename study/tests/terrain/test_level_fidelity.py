from dataclasses import replace

import numpy as np
import pytest
from fixtures.tile_sets import report_of
from scipy.ndimage import gaussian_filter

from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles.build import TileSet
from dav_gswt_study.terrain import lattice, level_fidelity

CELLS, SPACING = 16, 0.25
SIDE = CELLS * SPACING


def plain(cells, grey):
    grid = Ground(0.0, 0.0, SIDE / cells, 0, 0, cells, np.zeros((cells, cells)), np.ones((cells, cells), bool))
    return discs.make_ground_discs(grid, np.full((cells**2, 3), grey))


def tile_set(fields):
    """Labels with one cut down the middle."""
    count = len(fields[0])
    labels = np.zeros((count, CELLS, CELLS), np.uint8)
    labels[:, :, CELLS // 2 :] = 1
    return TileSet(SIDE, SPACING, fields, labels, np.zeros((count, 9, 2), int), np.zeros(count), report_of())


def test_a_level_that_is_too_bright_is_wrong_by_that_much():
    rows = level_fidelity.measure_levels(tile_set([[plain(CELLS, 0.5)] * 16, [plain(CELLS // 2, 0.6)] * 16]), 1.0, 0.1)
    for row in rows[:16]:
        assert row["oblique_db"] is row["walker_change"] is None and row["distance"] == 0
    for row in rows[16:]:
        # 0.1 everywhere is 20 dB and 25.5 of 255
        assert [row[k] for k in ("oblique_db", "oblique_cut_db", "walker_db")] == pytest.approx([20] * 3, abs=0.01)
        assert row["oblique_change"] == pytest.approx(25.5, abs=0.1)
        # the mean standard deviation covers one pixel there: (2 * 0.72 + 0.1) / 3 spacings of 0.5, at 1663 pixels
        assert row["distance"] == pytest.approx(0.5133 * 0.5 * 1662.8, rel=1e-3) and row["count"] == 64


def test_errors_are_those_of_the_tile_and_of_what_is_near_its_cut():
    fine, coarse = ([plain(cells, 0.5)] * 16 for cells in (CELLS, CELLS // 2))
    near = np.abs(coarse[5].means[:, 0] - SIDE / 2) < 0.2 * SIDE
    coarse[5] = replace(coarse[5], sh=coarse[5].sh - np.float32(0.5) * near[:, None, None])
    errors = level_fidelity.measure_errors(tile_set([fine, coarse]), 1, 200.0)
    worst = min((t for t in errors if errors[t]["db"] is not None), key=lambda t: errors[t]["db"])
    assert worst[0] == 5 and errors[5, "oblique"]["cut_db"] < errors[5, "oblique"]["db"] - 1


PIXELS, TILES = 32, 12


def texture(seed, shape):
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=shape), 1.0, mode="wrap")
    return 0.5 + 0.1 * noise[..., None] / noise.std() * np.ones(3)


def tiled(kinds):
    """Cells that show one of some textures each."""
    rng = np.random.default_rng(0)
    tiles = [texture(k + 1, (PIXELS, PIXELS)) for k in range(kinds)]
    rows = [np.concatenate([tiles[k] for k in rng.integers(kinds, size=TILES)], 1) for _ in range(TILES)]
    return np.concatenate(rows, 0)


def test_ground_that_never_repeats_has_no_lattice_and_cells_of_unlike_brightness_are_busy():
    picture = texture(0, (TILES * PIXELS, TILES * PIXELS))
    found = lattice.measure_lattice(picture, PIXELS)
    assert abs(found.brightness) < 0.02 and abs(found.landmarks) < 0.03
    assert found.mean_tile < 0.02 and found.busyness < 0.01
    shade = np.random.default_rng(1).normal(0, 0.1, (TILES, TILES)).repeat(PIXELS, 0).repeat(PIXELS, 1)
    assert lattice.measure_lattice(picture + shade[..., None], PIXELS).busyness > 0.3


def test_one_tile_everywhere_is_a_perfect_lattice_and_more_tiles_repeat_less():
    one, two, eight = (lattice.measure_lattice(tiled(kinds), PIXELS) for kinds in (1, 2, 8))
    assert one.brightness > 0.85 and one.landmarks > 0.7
    assert one.mean_tile > 0.95 and one.next > 0.9
    assert one.brightness > two.brightness > eight.brightness > 0.05
