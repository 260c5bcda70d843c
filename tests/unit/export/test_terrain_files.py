"""A finite terrain as files: each shows what the terrain shows, whatever the threads; nothing is half-written."""

from dataclasses import replace
from subprocess import CompletedProcess

import numpy as np
import pytest
from fixtures.finite_cells import collect_cells
from fixtures.splat_files import read_glb_splats, read_spz

from dav_gswt.errors import InputError
from dav_gswt.export import splat_files, terrain_files
from dav_gswt.export.axes import AXES, turn_field
from dav_gswt.field import read_field
from dav_gswt.files import digest_files
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render
from dav_gswt.terrain import finite, stills
from dav_gswt.terrain.finite import Area

READERS = {"ply": read_field, "spz": read_spz, "glb": read_glb_splats}
SIZE = 96
EVERY = np.ones((SIZE, SIZE))


def test_every_file_shows_what_the_terrain_shows(cover_bundle, cover_terrain, export, tmp_path, monkeypatch):
    """With the objects, the hills and the border of the materials, in the axes that terrain.json states."""
    monkeypatch.setattr(finite, "BLOCK", 3000)
    facts = export(columns=6, rows=6, formats=list(READERS))
    ground = float(cover_terrain.heights.at(np.zeros(1), np.zeros(1))[0][0])
    eye, ahead = np.array([0.0, 0.0, ground + 2 * cover_terrain.side]), np.array([0.3, 0.2, -1.0])
    there, here = (cameras.pinhole(at, at + ahead, SIZE, SIZE, 40.0) for at in (eye, eye - facts["origin"]))
    manifest = cover_bundle.manifest
    wanted = stills.render_view(cover_terrain, there, manifest.sky, manifest.ground_colour)
    exact = collect_cells(cover_terrain, -3, -3, 6, 6, 0)
    exact = replace(exact, means=exact.means - np.float32([3 * cover_terrain.side, 3 * cover_terrain.side, 0]))
    same = render(exact, here).colour
    for name, read in READERS.items():
        field = turn_field(read(tmp_path / f"out/terrain.{name}"), AXES[facts["files"][name]].T)
        assert len(field) == facts["gaussians"] == facts["gaussians_by_format"][name]
        shown = render(field, here).colour
        assert psnr(shown, wanted, EVERY) > 34 and psnr(shown, same, EVERY) > 38


def test_threads_change_no_byte(export, tmp_path, monkeypatch):
    monkeypatch.setattr(finite, "BLOCK", 500)
    for threads in (1, 3):
        export(str(threads), threads, formats=["ply", "glb", "spz", "3dtiles"], columns=12)
    names = sorted(path.relative_to(tmp_path / "1") for path in (tmp_path / "1").rglob("*.*"))
    assert {name.name for name in names} > {"terrain.glb", "terrain.json", "terrain.ply", "terrain.spz", "tileset.json"}
    for name in names:
        assert digest_files(tmp_path / "1" / name) == digest_files(tmp_path / "3" / name)


def test_without_what_a_format_needs_nothing_is_begun(export, tmp_path, monkeypatch):
    monkeypatch.setattr(splat_files.shutil, "which", lambda name: None)
    monkeypatch.setattr(terrain_files, "place_blocks", lambda *_: pytest.fail("work started"))
    with pytest.raises(InputError, match=r"exports: SOG needs Node\.js 20"):
        export(formats=["ply", "sog"])
    assert list(tmp_path.iterdir()) == []


def test_the_converter_is_given_a_ply(cover_terrain, export, tmp_path, monkeypatch):
    asked = []

    def run(words, **_):
        asked.extend(len(read_field(word)) for word in words if word.endswith(".ply"))
        return CompletedProcess(words, 0)

    monkeypatch.setattr(splat_files.shutil, "which", lambda name: "/bin/npx")
    monkeypatch.setattr(splat_files.subprocess, "run", run)
    facts = export(formats=["sog", "3dtiles"])
    counts = [len(collect_cells(cover_terrain, -1, -1, 3, 2, level)) for level in (0, 1)]
    assert asked == [facts["gaussians"]]
    assert facts["gaussians_by_format"] == {"sog": facts["gaussians"], "3dtiles": sum(counts)}
    assert facts["files"] == {"sog": "y-down", "3dtiles": "z-up"}
    monkeypatch.setattr(
        splat_files.subprocess, "run", lambda words, **_: CompletedProcess(words, 1, "", "no such thing")
    )
    with pytest.raises(InputError, match="splat-transform@2.7.1 failed: no such thing"):
        export("failed", formats=["sog"])
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["terrain.json", "terrain_3dtiles"]


@pytest.mark.parametrize(
    "centre, columns, expected",
    [
        ([0.0, 0.0], 3, Area(-1, -1, 3, 2)),
        ([10.5, -4.0], 3, Area(9, -5, 3, 2)),
        ([3.9, -0.5], 5, Area(1, -1, 5, 2)),
    ],
)
def test_cells_lie_about_the_centre(centre, columns, expected):
    assert terrain_files.choose_area({"columns": columns, "rows": 2, "centre": centre}) == expected
