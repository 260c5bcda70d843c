"""A finite terrain as files: each shows what the terrain shows, whatever the threads; nothing is half-written."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from fixtures.splat_files import read_glb_splats, read_spz, read_usd

from dav_gswt.errors import InputError
from dav_gswt.export import sog, terrain_files
from dav_gswt.export.axes import AXES, turn_field
from dav_gswt.export.terrain_area import plan_export
from dav_gswt.field import concatenate_fields, read_field
from dav_gswt.files import digest_files
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render
from dav_gswt.terrain import finite, stills

READERS = {"ply": read_field, "spz": read_spz, "glb": read_glb_splats, "usd": read_usd}
SIZE = 160


def export(bundle, terrain, settings, out, threads=1):
    terrain_files.export_terrain(terrain, bundle.manifest, settings, out, threads)
    return json.loads((out / "terrain.json").read_text())


@pytest.fixture(scope="module")
def view(cover_bundle, hills):
    """A picture of the terrain by its own renderer, and the camera."""
    from dav_gswt.terrain import endless

    terrain = endless.terrain_from_bundle(cover_bundle, hills)
    ground = float(terrain.heights.at(np.zeros(1), np.zeros(1))[0][0])
    eye = np.array([0.0, 0.0, ground + 2 * terrain.side])
    camera = cameras.pinhole(eye, eye + [0.3, 0.2, -1.0], SIZE, SIZE, 40.0)
    return camera, stills.render_view(terrain, camera, cover_bundle.manifest.sky, cover_bundle.manifest.ground_colour)


@pytest.mark.parametrize("name", list(READERS))
@pytest.mark.parametrize("axes", ["own", "z-up"])
def test_a_file_shows_what_the_terrain_shows(cover_bundle, cover_terrain, export_settings, view, tmp_path, name, axes):
    """With the objects, the hills and the border of the materials, in the axes that terrain.json states."""
    if name == "usd":
        pytest.importorskip("pxr", reason="needs the extra `usd`")
    settings = export_settings | {"columns": 8, "rows": 8, "formats": [name], "axes": axes}
    facts = export(cover_bundle, cover_terrain, settings, tmp_path / "out")
    stated = facts["files"][name]
    assert stated == (terrain_files.OWN_AXES[name] if axes == "own" else axes)
    field = turn_field(READERS[name](tmp_path / f"out/terrain.{'usdc' if name == 'usd' else name}"), AXES[stated].T)
    assert len(field) == facts["gaussians"]
    camera, wanted = view
    eye = camera.centre - facts["origin"]
    here = cameras.pinhole(eye, eye + [0.3, 0.2, -1.0], SIZE, SIZE, 40.0)
    assert psnr(render(field, here).colour, wanted, np.ones((SIZE, SIZE))) > 34
    exact = finite.collect_cells(cover_terrain, -4, -4, 8, 8, 0)
    exact = replace(exact, means=exact.means - np.float32([4 * cover_terrain.side, 4 * cover_terrain.side, 0]))
    shown, same = render(field, here).colour, render(exact, here).colour
    assert psnr(shown, same, np.ones((SIZE, SIZE))) > 38


def test_by_distance_shows_what_the_terrain_shows_from_the_eye(cover_bundle, cover_terrain, export_settings, tmp_path):
    settings = export_settings | {"columns": 12, "rows": 12, "level": "by_distance", "formats": ["ply"], "axes": "z-up"}
    facts = export(cover_bundle, cover_terrain, settings, tmp_path / "out")
    field = read_field(tmp_path / "out/terrain.ply")
    fine = len(finite.collect_cells(cover_terrain, -6, -6, 12, 12, 0))
    assert facts["level"] == "by_distance" and 0 < len(field) < fine
    eye = np.array(facts["eye"])
    ahead = np.array([1.0, 0.4, -0.15])
    here, there = (cameras.pinhole(at, at + ahead, SIZE, SIZE, 40.0) for at in (eye, eye + facts["origin"]))
    manifest = cover_bundle.manifest
    near = replace(cover_terrain, reach=4)  # nothing that the file does not have
    wanted = stills.render_view(near, there, manifest.sky, manifest.ground_colour)
    seen = render(field, here)
    ground = np.zeros((SIZE, SIZE))
    ground[SIZE // 2 :] = 1  # nearer than the reach
    assert psnr(seen.colour, wanted, ground) > 32


def test_threads_change_no_byte(cover_bundle, cover_terrain, export_settings, tmp_path, monkeypatch):
    monkeypatch.setattr(finite, "BLOCK", 500)
    settings = export_settings | {"formats": ["ply", "glb", "spz"], "level": "by_distance"}
    for threads in (1, 3):
        export(cover_bundle, cover_terrain, settings, tmp_path / str(threads), threads)
    names = sorted(path.name for path in (tmp_path / "1").iterdir())
    assert names == ["terrain.glb", "terrain.json", "terrain.ply", "terrain.spz"]
    for name in names:
        assert digest_files(tmp_path / "1" / name) == digest_files(tmp_path / "3" / name)


def test_blocks_hold_every_gaussian_once(cover_terrain, export_settings, monkeypatch):
    wanted = plan_export(cover_terrain, export_settings, 0.5)
    whole = finite.collect_cells(cover_terrain, -1, -1, 3, 2, 0)
    monkeypatch.setattr(finite, "BLOCK", 300)
    parts = list(terrain_files.place_blocks(cover_terrain, wanted))
    assert len(parts) > 2
    shift = np.float32(np.array([-cover_terrain.side, -cover_terrain.side, 0]) - wanted.origin)
    found, expected = concatenate_fields(parts).means, whole.means + shift
    order, other = (np.lexsort(np.round(means, 3).T) for means in (found, expected))
    np.testing.assert_allclose(found[order], expected[other], atol=2e-5)


def test_without_node_nothing_is_begun(cover_bundle, cover_terrain, export_settings, tmp_path, monkeypatch):
    monkeypatch.setattr(sog.shutil, "which", lambda name: None)
    with pytest.raises(InputError, match=r"exports/terrain: SOG needs Node\.js 20"):
        export(cover_bundle, cover_terrain, export_settings | {"formats": ["ply", "sog"]}, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_without_the_package_of_usd_nothing_is_begun(
    cover_bundle, cover_terrain, export_settings, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "pxr.UsdVol", None)
    with pytest.raises(InputError, match="exports/terrain: USD needs the extra `usd`"):
        export(cover_bundle, cover_terrain, export_settings | {"formats": ["ply", "usd"]}, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_nothing(cover_bundle, cover_terrain, export_settings, tmp_path, monkeypatch):
    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(terrain_files.glb_splats, "write_glb_splats", fail)
    with pytest.raises(OSError, match="disk full"):
        export(cover_bundle, cover_terrain, export_settings | {"formats": ["ply", "glb"]}, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_the_converter_is_given_a_ply_and_all_levels(
    cover_bundle, cover_terrain, export_settings, tmp_path, monkeypatch
):
    asked = []

    def run(words, **_):
        asked.append([len(read_field(word)) if word.endswith(".ply") else word for word in words])
        return type("Done", (), {"returncode": 0, "stderr": "", "stdout": ""})

    monkeypatch.setattr(sog.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(sog.subprocess, "run", run)
    settings = export_settings | {"formats": ["sog", "streamed_sog"]}
    facts = export(cover_bundle, cover_terrain, settings, tmp_path / "out")
    counts = [len(finite.collect_cells(cover_terrain, -1, -1, 3, 2, level)) for level in (0, 1)]
    assert [[word for word in words if type(word) is int] for words in asked] == [[facts["gaussians"]], counts]
    assert facts["gaussians_by_format"] == {"sog": facts["gaussians"], "streamed_sog": sum(counts)}
    assert asked[1][-2:] == ["-X", "4"]  # a tile's side
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["terrain.json", "terrain_sog"]


def test_a_tileset_counts_all_levels(cover_bundle, cover_terrain, export_settings, tmp_path):
    settings = export_settings | {"formats": ["ply", "3dtiles"], "level": 1}
    facts = export(cover_bundle, cover_terrain, settings, tmp_path / "out")
    counts = [len(finite.collect_cells(cover_terrain, -1, -1, 3, 2, level)) for level in (0, 1)]
    assert facts["gaussians"] == counts[1]
    assert facts["gaussians_by_format"] == {"ply": counts[1], "3dtiles": sum(counts)}
