"""Patches of terrain for other viewers: every tile once, where its colours meet; what is said without Node.js."""

import gzip
import json
import shutil
import subprocess
import zipfile
from dataclasses import replace

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
    patch = splats.assemble_patch(fields[1], SIDE)
    x, y, z = patch.means.T
    for axes, means in (("ply", [x, -z, y]), ("ply_z-up", [x, y, z])):
        splats.write_plys(tmp_path / "gswt.zip", SIDE, tmp_path / axes, axes)
        assert sorted(p.name for p in (tmp_path / axes).iterdir()) == ["level0.ply", "level1.ply"]
        read = field.read_field(tmp_path / axes / "level1.ply")
        np.testing.assert_allclose(read.means, np.stack(means, 1), atol=1e-5)
        np.testing.assert_allclose(read.log_scales, patch.log_scales, atol=1e-5)


def test_patches_have_float_columns_alone_as_plain_readers_need(fields, tmp_path):
    gswt.write_gswt(fields, SIDE, tmp_path / "gswt.zip")
    splats.write_plys(tmp_path / "gswt.zip", SIDE, tmp_path / "ply")
    data = PlyData.read(str(tmp_path / "ply/level0.ply"))["vertex"].data
    assert set(data.dtype.descr) == {(name, "<f4") for name in PLAIN}


PLAIN = [*("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")]
PLAIN += [*("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")]


def test_without_node_the_message_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(sog.shutil, "which", lambda name: None)
    (tmp_path / "ply").mkdir()
    (tmp_path / "ply/level0.ply").write_bytes(b"")
    with pytest.raises(InputError, match=r"exports/sog: SOG needs Node\.js 20 .* PLY, SPZ and GLB do not"):
        splats.convert_plys(tmp_path / "ply", "sog", tmp_path / "sog")
    assert not (tmp_path / "sog").exists()


def test_a_folder_without_a_level_is_named(tmp_path):
    with pytest.raises(InputError, match=r"there is no level\{l\}\.ply in it; make exports/ply again"):
        splats.convert_plys(tmp_path, "spz", tmp_path / "spz")


def test_the_converter_is_asked_for_every_level(fields, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(sog.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(sog.subprocess, "run", lambda words, **_: asked.append(words) or Done(0, ""))
    (tmp_path / "ply").mkdir()
    for level in (0, 1):
        field.write_field(splats.assemble_patch(fields[level], SIDE), tmp_path / f"ply/level{level}.ply")
    splats.convert_plys(tmp_path / "ply", "sog", tmp_path / "sog")
    assert len(asked) == 3 and all(words[2] == "@playcanvas/splat-transform@2.7.1" for words in asked)
    assert [name in words[5] for name, words in zip(("level0.", "level1."), asked, strict=False)] == [True, True]
    assert [words for words in asked[2] if words in ("0", "1")] == ["0", "1"] and asked[2].count("-l") == 2
    assert asked[2][-1] == "2"  # chunks as wide as a tile


def test_what_the_converter_complains_of_is_passed_on(tmp_path, monkeypatch):
    monkeypatch.setattr(sog.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(sog.subprocess, "run", lambda words, **_: Done(1, "no such thing"))
    (tmp_path / "ply").mkdir()
    (tmp_path / "ply/level0.ply").write_bytes(b"")
    with pytest.raises(InputError, match="splat-transform@2.7.1 failed: no such thing"):
        splats.convert_plys(tmp_path / "ply", "sog", tmp_path / "sog")
    assert not (tmp_path / "sog").exists()


class Done:
    """A program that has run."""

    def __init__(self, returncode, stderr):
        self.returncode, self.stderr, self.stdout = returncode, stderr, ""


@pytest.fixture(scope="module")
def converted(fields, tmp_path_factory):
    """PLYs of the patch, and what splat-transform makes of them."""
    if shutil.which("npx") is None:
        pytest.skip("npx is not here")
    probe = subprocess.run(
        ["npx", "--yes", sog.PACKAGE, "--version"], capture_output=True, text=True, check=False, timeout=120
    )
    if probe.returncode:
        pytest.skip(f"{sog.PACKAGE} cannot be fetched: {probe.stderr.strip()[-100:]}")
    folder = tmp_path_factory.mktemp("converted")
    gswt.write_gswt(fields, SIDE, folder / "gswt.zip")
    splats.write_plys(folder / "gswt.zip", SIDE, folder / "ply")
    splats.convert_plys(folder / "ply", "sog", folder / "sog")
    return folder


@pytest.mark.parametrize("version", [None, 2, 3])
def test_an_spz_is_of_the_version_asked_for_with_y_up_and_north_away(fields, tmp_path, version):
    gswt.write_gswt(fields, SIDE, tmp_path / "gswt.zip")
    splats.write_plys(tmp_path / "gswt.zip", SIDE, tmp_path / "ply")
    splats.convert_plys(tmp_path / "ply", "spz", tmp_path / "spz", version)
    assert sorted(p.name for p in (tmp_path / "spz").iterdir()) == ["level0.spz", "level1.spz"]
    x, y, z = splats.assemble_patch(fields[0], SIDE).means.T
    read = read_spz(tmp_path / "spz/level0.spz")
    assert gzip.decompress((tmp_path / "spz/level0.spz").read_bytes())[4] == (version or 3)
    np.testing.assert_allclose(read.means, np.stack([x, z, -y], 1), atol=1e-3)  # right, up, back


def test_a_single_sog_lies_beside_the_streamed_set_and_both_hold_every_gaussian(fields, converted):
    counts = [sum(map(len, tiles)) for tiles in fields]
    assert json.loads((converted / "sog/lod-meta.json").read_text())["counts"] == counts
    for level, count in enumerate(counts):
        with zipfile.ZipFile(converted / f"sog/level{level}.sog") as archive:
            meta = json.loads(archive.read("meta.json"))
        assert meta["count"] == count and "means" in meta


def test_a_sog_has_the_axes_of_the_ply(fields, converted):
    """Its own positions are compressed; their bounds are not: sign(v) log(1 + |v|)."""
    means = field.read_field(converted / "ply/level0.ply").means
    with zipfile.ZipFile(converted / "sog/level0.sog") as archive:
        bounds = json.loads(archive.read("meta.json"))["means"]
    for key, value in (("mins", means.min(0)), ("maxs", means.max(0))):
        np.testing.assert_allclose(bounds[key], np.sign(value) * np.log1p(np.abs(value)), atol=1e-4)
