"""Patches of terrain for other viewers: every tile once, where its colours meet."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.splats import rough_ground
from plyfile import PlyData

from dav_gswt import field
from dav_gswt.bundle import gswt
from dav_gswt.export import terrain_files

SIDE = 2.0
PLAIN = [*("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")]
PLAIN += [*("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")]


@pytest.fixture(scope="module")
def fields():
    """Thirty-two tiles: two variants, each with as many stones as chance gives it."""
    return [[rough_ground(tile, 8 >> level, SIDE) for tile in range(32)] for level in range(2)]


def test_a_patch_holds_every_tile_once_in_its_own_cell(fields):
    patch = terrain_files.assemble_patch(fields[0], SIDE)
    assert len(patch) == sum(map(len, fields[0]))
    cell = np.floor(patch.means[:, :2] / SIDE).astype(int)
    counts = {tuple(c): int(n) for c, n in zip(*np.unique(cell, axis=0, return_counts=True), strict=True)}
    assert set(counts) == {(i, j) for i in range(8) for j in range(4)}
    assert sorted(counts.values()) == sorted(map(len, fields[0]))


def test_colours_meet_inside_a_patch_and_where_it_closes(fields):
    """Tiles of one Gaussian each, whose colour is the tile's number."""
    numbered = [replace(f[:1], sh=np.full((1, 1, 3), tile, np.float32)) for tile, f in enumerate(fields[0])]
    patch = terrain_files.assemble_patch(numbered, SIDE)
    column, row = np.floor(patch.means[:, :2] / SIDE).astype(int).T
    laid = np.zeros((4, 8), int)
    laid[row, column] = patch.sh[:, 0, 0]
    west, north, east, south = (laid >> bit & 1 for bit in (3, 2, 1, 0))
    np.testing.assert_array_equal(east, np.roll(west, -1, axis=1))
    np.testing.assert_array_equal(north, np.roll(south, -1, axis=0))


def test_patches_are_plys_of_every_level_with_y_down_and_float_columns_alone(fields, tmp_path):
    gswt.write_gswt(fields, SIDE, tmp_path / "gswt.zip")
    terrain_files.write_plys(tmp_path / "gswt.zip", SIDE, tmp_path / "ply")
    patch = terrain_files.assemble_patch(fields[1], SIDE)
    x, y, z = patch.means.T
    assert sorted(p.name for p in (tmp_path / "ply").iterdir()) == ["level0.ply", "level1.ply"]
    read = field.read_field(tmp_path / "ply/level1.ply")
    np.testing.assert_allclose(read.means, np.stack([x, -z, y], 1), atol=1e-5)
    np.testing.assert_allclose(read.log_scales, patch.log_scales, atol=1e-5)
    data = PlyData.read(str(tmp_path / "ply/level0.ply"))["vertex"].data
    assert set(data.dtype.descr) == {(name, "<f4") for name in PLAIN}
