"""A finite terrain as files: each shows what the terrain shows, whatever the threads; nothing is half-written."""

import sys
from dataclasses import replace
from importlib.util import find_spec
from subprocess import CompletedProcess

import numpy as np
import pytest
from fixtures.splat_files import read_glb_splats, read_spz, read_usd

from dav_gswt.errors import InputError
from dav_gswt.export import splat_files, terrain_files
from dav_gswt.export.axes import AXES, turn_field
from dav_gswt.export.formats import EXPORTERS
from dav_gswt.field import read_field
from dav_gswt.files import digest_files
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render
from dav_gswt.terrain import finite, stills

READERS = {"ply": read_field, "spz": read_spz, "glb": read_glb_splats, "usd": read_usd}
SIZE = 96
EVERY = np.ones((SIZE, SIZE))


@pytest.mark.parametrize("axes", ["own", "z-up"])
def test_every_file_shows_what_the_terrain_shows(cover_bundle, cover_terrain, export, tmp_path, monkeypatch, axes):
    """With the objects, the hills and the border of the materials, in the axes that terrain.json states."""
    monkeypatch.setattr(finite, "BLOCK", 3000)
    readers = {name: read for name, read in READERS.items() if name != "usd" or find_spec("pxr")}
    facts = export(columns=6, rows=6, formats=list(readers), axes=axes)
    ground = float(cover_terrain.heights.at(np.zeros(1), np.zeros(1))[0][0])
    eye, ahead = np.array([0.0, 0.0, ground + 2 * cover_terrain.side]), np.array([0.3, 0.2, -1.0])
    there, here = (cameras.pinhole(at, at + ahead, SIZE, SIZE, 40.0) for at in (eye, eye - facts["origin"]))
    manifest = cover_bundle.manifest
    wanted = stills.render_view(cover_terrain, there, manifest.sky, manifest.ground_colour)
    exact = finite.collect_cells(cover_terrain, -3, -3, 6, 6, 0)
    exact = replace(exact, means=exact.means - np.float32([3 * cover_terrain.side, 3 * cover_terrain.side, 0]))
    same = render(exact, here).colour
    for name, read in readers.items():
        stated = facts["files"][name]
        assert stated == (EXPORTERS[name].axes[0] if axes == "own" else axes)
        field = turn_field(read(tmp_path / f"out/terrain.{'usdc' if name == 'usd' else name}"), AXES[stated].T)
        assert len(field) == facts["gaussians"] == facts["gaussians_by_format"][name]
        shown = render(field, here).colour
        assert psnr(shown, wanted, EVERY) > 34 and psnr(shown, same, EVERY) > 38


def test_threads_change_no_byte_and_coarser_levels_lie_far_from_the_eye(cover_terrain, export, tmp_path, monkeypatch):
    monkeypatch.setattr(finite, "BLOCK", 500)
    settings = {"formats": ["ply", "glb", "spz"], "level": "by_distance", "columns": 12}
    first, _ = (export(str(k), k, **settings) for k in (1, 3))
    names = sorted(path.name for path in (tmp_path / "1").iterdir())
    assert names == ["terrain.glb", "terrain.json", "terrain.ply", "terrain.spz"]
    for name in names:
        assert digest_files(tmp_path / "1" / name) == digest_files(tmp_path / "3" / name)
    far = np.abs(read_field(tmp_path / "1/terrain.ply").means[:, 0] - first["eye"][0]) > 4 * cover_terrain.side
    fine = finite.collect_cells(cover_terrain, -6, -1, 12, 2, 0)
    beyond = np.abs(fine.means[:, 0] - 6 * cover_terrain.side) > 4 * cover_terrain.side
    assert first["level"] == "by_distance" and 0 < far.sum() < 0.5 * beyond.sum()
    assert (~far).sum() > 0.7 * (~beyond).sum()


@pytest.mark.parametrize("name, said", [("sog", r"SOG needs Node\.js 20"), ("usd", "USD needs the extra `usd`")])
def test_without_what_a_format_needs_nothing_is_begun(export, tmp_path, monkeypatch, name, said):
    monkeypatch.setattr(splat_files.shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "pxr.UsdVol", None)
    monkeypatch.setattr(terrain_files, "place_blocks", lambda *_: pytest.fail("work started"))
    with pytest.raises(InputError, match=f"exports: {said}"):
        export(formats=["ply", name])
    assert list(tmp_path.iterdir()) == []


def test_the_converter_is_given_a_ply_and_all_levels(cover_terrain, export, tmp_path, monkeypatch):
    asked = []

    def run(words, **_):
        asked.append([len(read_field(word)) if word.endswith(".ply") else word for word in words])
        return CompletedProcess(words, 0)

    monkeypatch.setattr(splat_files.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(splat_files.subprocess, "run", run)
    facts = export(formats=["sog", "streamed_sog", "3dtiles"], axes="y-down")
    counts = [len(finite.collect_cells(cover_terrain, -1, -1, 3, 2, level)) for level in (0, 1)]
    assert [[word for word in words if type(word) is int] for words in asked] == [[facts["gaussians"]], counts]
    held = facts["gaussians_by_format"]
    assert held == {"sog": facts["gaussians"], "streamed_sog": sum(counts), "3dtiles": sum(counts)}
    assert asked[1][-2:] == ["-X", "4"] and asked[1].count("-l") == 2  # a tile's side
    assert facts["files"] == {"sog": "y-down", "streamed_sog": "y-down", "3dtiles": "z-up"}  # which has no other
    monkeypatch.setattr(
        splat_files.subprocess, "run", lambda words, **_: CompletedProcess(words, 1, "", "no such thing")
    )
    with pytest.raises(InputError, match="splat-transform@2.7.1 failed: no such thing"):
        export("failed", formats=["sog"])
    names = ["terrain.json", "terrain_3dtiles", "terrain_sog"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == names
