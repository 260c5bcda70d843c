"""Errors of levels: none of equal ones, those of a step by hand, every tile in sight."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.tile_sets import report_of

from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.study.terrain import level_fidelity
from dav_gswt.tiles.build import TileSet

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


def test_the_torus_holds_every_tile_once_and_colours_meet():
    torus = level_fidelity.arrange_torus(0)
    assert sorted(torus[1:-1, 1:-1].ravel()) == list(range(16))
    np.testing.assert_array_equal(torus[:, :-1] >> 1 & 1, torus[:, 1:] >> 3 & 1)  # E and W
    np.testing.assert_array_equal(torus[:-1] >> 2 & 1, torus[1:] & 1)  # N and S
    np.testing.assert_array_equal(level_fidelity.arrange_torus(2), torus + 32)


def test_a_level_that_is_too_bright_is_wrong_by_that_much():
    fine = [plain(CELLS, 0.5) for _ in range(16)]
    coarse = [plain(CELLS // 2, 0.6) for _ in range(16)]
    rows = level_fidelity.measure_levels(tile_set([fine, coarse]), 1.0, 0.1)
    assert [(r["level"], r["tile"]) for r in rows] == [(level, tile) for level in (0, 1) for tile in range(16)]
    for row in rows[:16]:
        assert row["oblique_db"] is row["walker_change"] is None and row["distance"] == 0
    for row in rows[16:]:
        # 0.1 everywhere is 20 dB and 25.5 of 255
        assert [row[k] for k in ("oblique_db", "oblique_cut_db", "walker_db")] == pytest.approx([20] * 3, abs=0.01)
        assert row["oblique_change"] == pytest.approx(25.5, abs=0.1)
        # the mean standard deviation covers one pixel there: (2 * 0.72 + 0.1) / 3 spacings of 0.5, at 1663 pixels
        assert row["distance"] == pytest.approx(0.5133 * 0.5 * 1662.8, rel=1e-3) and row["count"] == 64


def test_errors_are_those_of_the_tile_and_of_what_is_near_its_cut():
    fine = [plain(CELLS, 0.5) for _ in range(16)]
    coarse = [plain(CELLS // 2, 0.5) for _ in range(16)]
    x = coarse[5].means[:, 0]
    dark = coarse[5].sh - np.float32(0.5) * (np.abs(x - SIDE / 2) < 0.2 * SIDE)[:, None, None]
    coarse[5] = replace(coarse[5], sh=dark)
    errors = level_fidelity.measure_errors(tile_set([fine, coarse]), 1, 200.0)
    worst = min((t for t in errors if errors[t]["db"] is not None), key=lambda t: errors[t]["db"])
    assert worst[0] == 5 and errors[5, "oblique"]["cut_db"] < errors[5, "oblique"]["db"] - 1


def test_a_level_that_equals_the_finest_changes_nothing():
    fine = [plain(CELLS, 0.1 + t / 20) for t in range(16)]
    errors = level_fidelity.measure_errors(tile_set([fine, fine]), 1, 200.0)
    assert len(errors) == 32 and all(t["change"] == 0 and t["db"] is None for t in errors.values())


def test_each_variant_is_measured_by_itself():
    fine = [plain(CELLS, 0.5) for _ in range(32)]
    other = [replace(f, sh=f.sh + np.float32(0.1 * (t >= 16))) for t, f in enumerate(fine)]
    errors = level_fidelity.measure_errors(tile_set([fine, other]), 1, 200.0)
    assert errors[3, "oblique"]["change"] == 0 and errors[19, "oblique"]["change"] > 5
