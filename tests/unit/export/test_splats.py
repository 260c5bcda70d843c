"""Patches of terrain for other viewers: every tile once, where its colours meet; what is said without Node.js."""

import gzip
import json
import zipfile
from dataclasses import replace
from subprocess import CompletedProcess

import numpy as np
import pytest
from fixtures.splat_files import read_spz
from fixtures.splats import rough_ground
from plyfile import PlyData

from dav_gswt import field
from dav_gswt.bundle import gswt
from dav_gswt.errors import InputError
from dav_gswt.export import sog, splats

SIDE = 2.0
PLAIN = [*("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")]
PLAIN += [*("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")]


@pytest.fixture(scope="module")
def fields():
    """Thirty-two tiles: two variants, each with as many stones as chance gives it."""
    return [[rough_ground(tile, 8 >> level, SIDE) for tile in range(32)] for level in range(2)]


@pytest.fixture(scope="module")
def plys(fields, tmp_path_factory):
    """The folder of level{l}.ply."""
    folder = tmp_path_factory.mktemp("patches")
    gswt.write_gswt(fields, SIDE, folder / "gswt.zip")
    for axes in splats.AXES:
        splats.write_plys(folder / "gswt.zip", SIDE, folder / axes, axes)
    return folder / "ply"


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


def test_patches_are_plys_of_every_level_in_the_bundle_s_unit_with_float_columns_alone(fields, plys):
    patch = splats.assemble_patch(fields[1], SIDE)
    x, y, z = patch.means.T
    for axes, means in (("ply", [x, -z, y]), ("ply_z-up", [x, y, z])):
        assert sorted(p.name for p in (plys.parent / axes).iterdir()) == ["level0.ply", "level1.ply"]
        read = field.read_field(plys.parent / axes / "level1.ply")
        np.testing.assert_allclose(read.means, np.stack(means, 1), atol=1e-5)
        np.testing.assert_allclose(read.log_scales, patch.log_scales, atol=1e-5)
    data = PlyData.read(str(plys / "level0.ply"))["vertex"].data
    assert set(data.dtype.descr) == {(name, "<f4") for name in PLAIN}


def test_without_node_or_levels_or_where_the_converter_fails_the_message_says_what_to_do(plys, tmp_path, monkeypatch):
    def convert(message, folder, kind):
        with pytest.raises(InputError, match=message):
            splats.convert_plys(folder, kind, tmp_path / "out")
        assert not (tmp_path / "out").exists()

    convert(r"there is no level\{l\}\.ply in it; make exports/ply again", tmp_path, "spz")
    monkeypatch.setattr(sog.shutil, "which", lambda name: None)
    convert(r"exports/sog: SOG needs Node\.js 20 .* PLY, SPZ and GLB do not", plys, "sog")
    monkeypatch.setattr(sog.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(sog.subprocess, "run", lambda words, **_: CompletedProcess(words, 1, "", "no such thing"))
    convert("splat-transform@2.7.1 failed: no such thing", plys, "sog")


def test_the_converter_is_asked_for_every_level(plys, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(sog.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(sog.subprocess, "run", lambda words, **_: asked.append(words) or CompletedProcess(words, 0))
    splats.convert_plys(plys, "sog", tmp_path / "sog")
    assert len(asked) == 3 and all(words[2] == "@playcanvas/splat-transform@2.7.1" for words in asked)
    assert [name in words[5] for name, words in zip(("level0.", "level1."), asked, strict=False)] == [True, True]
    assert [words for words in asked[2] if words in ("0", "1")] == ["0", "1"] and asked[2].count("-l") == 2
    assert asked[2][-1] == "2"  # chunks as wide as a tile


@pytest.mark.slow
def test_the_real_converter_writes_sogs_with_the_counts_and_the_axes_of_the_plys(
    fields, plys, node_modules, tmp_path, monkeypatch
):
    monkeypatch.chdir(node_modules.parent)  # where npx finds it
    splats.convert_plys(plys, "sog", tmp_path / "sog")
    counts = [sum(map(len, tiles)) for tiles in fields]
    assert json.loads((tmp_path / "sog/lod-meta.json").read_text())["counts"] == counts
    for level, count in enumerate(counts):
        with zipfile.ZipFile(tmp_path / f"sog/level{level}.sog") as archive:
            meta = json.loads(archive.read("meta.json"))
        means = field.read_field(plys / f"level{level}.ply").means
        ends = np.stack([means.min(0), means.max(0)])
        bounds = [meta["means"]["mins"], meta["means"]["maxs"]]
        np.testing.assert_allclose(bounds, np.sign(ends) * np.log1p(np.abs(ends)), atol=1e-4)  # as SOG keeps positions
        assert meta["count"] == count


@pytest.mark.parametrize("version", [None, 2])
def test_an_spz_is_of_the_version_asked_for_with_y_up_and_north_away(fields, plys, tmp_path, version):
    splats.convert_plys(plys, "spz", tmp_path / "spz", version)
    assert sorted(p.name for p in (tmp_path / "spz").iterdir()) == ["level0.spz", "level1.spz"]
    x, y, z = splats.assemble_patch(fields[0], SIDE).means.T
    read = read_spz(tmp_path / "spz/level0.spz")
    assert gzip.decompress((tmp_path / "spz/level0.spz").read_bytes())[4] == (version or 3)
    np.testing.assert_allclose(read.means, np.stack([x, z, -y], 1), atol=1e-3)  # right, up, back
