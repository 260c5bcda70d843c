"""Patches of terrain for other viewers: every tile once, where its colours meet; what is said without Node.js."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.splats import rough_ground

from dav_gswt import field
from dav_gswt.bundle import gswt
from dav_gswt.errors import InputError
from dav_gswt.export import splats

SIDE = 2.0


@pytest.fixture(scope="module")
def fields():
    """Thirty-two tiles: two variants, each with as many stones as chance gives it."""
    return [[rough_ground(tile, 8 >> level, SIDE) for tile in range(32)] for level in range(2)]


def test_a_patch_holds_every_tile_once_in_its_own_cell(fields):
    patch = splats.assemble_patch(fields[0], SIDE)
    assert len(patch) == sum(map(len, fields[0]))
    cell = np.floor(patch.means[:, :2] / SIDE).astype(int)
    counts = {tuple(c): int(n) for c, n in zip(*np.unique(cell, axis=0, return_counts=True), strict=True)}
    assert set(counts) == {(i, j) for i in range(8) for j in range(4)}
    assert sorted(counts.values()) == sorted(map(len, fields[0]))


def test_colours_meet_inside_a_patch_and_where_it_closes(fields):
    """Tiles of one Gaussian each, whose colour is the tile's number."""
    numbered = [replace(f[:1], sh=np.full((1, 1, 3), tile, np.float32)) for tile, f in enumerate(fields[0])]
    patch = splats.assemble_patch(numbered, SIDE)
    column, row = np.floor(patch.means[:, :2] / SIDE).astype(int).T
    laid = np.zeros((4, 8), int)
    laid[row, column] = patch.sh[:, 0, 0]
    west, north, east, south = (laid >> bit & 1 for bit in (3, 2, 1, 0))
    np.testing.assert_array_equal(east, np.roll(west, -1, axis=1))
    np.testing.assert_array_equal(north, np.roll(south, -1, axis=0))


def test_patches_are_plys_of_every_level_in_the_bundle_s_unit(fields, tmp_path):
    gswt.write_gswt(fields, SIDE, tmp_path / "gswt.zip")
    splats.write_plys(tmp_path / "gswt.zip", SIDE, tmp_path / "ply")
    assert sorted(p.name for p in (tmp_path / "ply").iterdir()) == ["level0.ply", "level1.ply"]
    read, patch = field.read_field(tmp_path / "ply/level1.ply"), splats.assemble_patch(fields[1], SIDE)
    np.testing.assert_allclose(read.means, patch.means, atol=1e-5)
    np.testing.assert_allclose(read.log_scales, patch.log_scales, atol=1e-5)


def test_without_node_the_message_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(splats.shutil, "which", lambda name: None)
    (tmp_path / "ply").mkdir()
    with pytest.raises(InputError, match=r"exports/sog: needs Node\.js 20 .* exports/ply needs neither"):
        splats.convert_plys(tmp_path / "ply", "sog", tmp_path / "sog")
    assert not (tmp_path / "sog").exists()


@pytest.mark.parametrize("kind, calls", [("spz", 2), ("sog", 1)])
def test_the_converter_is_asked_for_every_level(tmp_path, monkeypatch, kind, calls):
    asked = []
    monkeypatch.setattr(splats.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(splats.subprocess, "run", lambda words, **_: asked.append(words) or Done(0, ""))
    (tmp_path / "ply").mkdir()
    for level in (0, 1):
        (tmp_path / f"ply/level{level}.ply").write_bytes(b"")
    splats.convert_plys(tmp_path / "ply", kind, tmp_path / kind)
    assert len(asked) == calls and all(words[2] == "@playcanvas/splat-transform@2.7.1" for words in asked)
    if kind == "sog":
        assert [words for words in asked[0] if words in ("0", "1")] == ["0", "1"] and asked[0].count("-l") == 2


def test_what_the_converter_complains_of_is_passed_on(tmp_path, monkeypatch):
    monkeypatch.setattr(splats.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(splats.subprocess, "run", lambda words, **_: Done(1, "no such thing"))
    (tmp_path / "ply").mkdir()
    (tmp_path / "ply/level0.ply").write_bytes(b"")
    with pytest.raises(InputError, match="splat-transform@2.7.1 failed: no such thing"):
        splats.convert_plys(tmp_path / "ply", "spz", tmp_path / "spz")
    assert not (tmp_path / "spz").exists()


class Done:
    """A program that has run."""

    def __init__(self, returncode, stderr):
        self.returncode, self.stderr, self.stdout = returncode, stderr, ""
