"""`dav-gswt export`: the files that Snakemake would make, one line for what makes no sense, nothing in the way."""

import shutil

import pytest
from fixtures.land_covers import cover_content, write_cover_bundle

from dav_gswt.bundle import store
from dav_gswt.cli import main
from dav_gswt.config.settings import Export
from dav_gswt.export import terrain_files
from dav_gswt.terrain import endless
from dav_gswt.terrain.heights import Hills
from dav_gswt.terrain.page import write_page
from dav_gswt.tiles.store import write_tiles

HILLS = Hills(2.0, 30.0, 3, 5)


@pytest.fixture(scope="module")
def result(root, tmp_path_factory):
    """A folder as results/ has it: a bundle with its page on hills, and the tiles."""
    folder = tmp_path_factory.mktemp("results") / "scene"
    bundle = folder / "tiles_auto/bundle_tau0.6"
    bundle.parent.mkdir(parents=True)
    write_cover_bundle(bundle)
    write_page(bundle, root / "workflow/viewer", bundle / "terrain/page", HILLS)
    write_tiles(cover_content().tiles, bundle.parent / "tiles", bundle.parent / "seams.json", {})
    return folder


def run(*arguments):
    return main.main(["export", *map(str, arguments)])


def test_it_writes_what_the_rule_writes(result, tmp_path):
    bundle, size = result / "tiles_auto/bundle_tau0.6", ("--columns", 2, "--rows", 3)
    assert run(bundle, *size, "--formats", "glb", "ply", "ground", "-o", tmp_path / "out") == 0
    assert (tmp_path / "out/ground/ground.xml").is_file()
    read = store.read_bundle(bundle)
    terrain = endless.terrain_from_fields(
        read.fields(), read.manifest, HILLS, [[read.object_chunk(0, level) for level in range(2)]]
    )
    settings = Export(columns=2, rows=3, formats=["glb", "ply"]).model_dump(mode="json", exclude_none=True)
    terrain_files.export_terrain(terrain, read.manifest, settings, tmp_path / "wanted")
    files = {path.name: path.read_bytes() for path in (tmp_path / "wanted").iterdir()}
    assert {path.name: path.read_bytes() for path in (tmp_path / "out/terrain").iterdir()} == files
    assert set(files) == {"terrain.glb", "terrain.ply", "terrain.json"}


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--level", "9"], "export.level: there is no level 9; the last one is 1"),
        (["--columns", "2000"], "export.columns: "),
        (["--columns", "90"], "% of that, or a coarser export.level"),
        (["--columns", "400", "--rows", "400", "--formats", "ground"], "have a height field of"),
    ],
)
def test_what_makes_no_sense_is_one_line_and_writes_nothing(result, tmp_path, capsys, monkeypatch, arguments, said):
    monkeypatch.setattr(terrain_files, "MAX_BYTES", 10**6)
    assert run(result, *arguments, "-o", tmp_path / "out") == 1
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_nothing_of_others_is_replaced(result, tmp_path, capsys):
    (tmp_path / "terrain").mkdir()
    (tmp_path / "terrain/mine.txt").write_text("kept")
    assert run(result, "--columns", 1, "--rows", 1, "-o", tmp_path) == 1
    assert "is in the way" in capsys.readouterr().err
    assert (tmp_path / "terrain/mine.txt").read_text() == "kept"
    assert run(result, "--columns", 1, "--rows", 1, "-o", tmp_path / "terrain/mine.txt") == 1
    assert "mine.txt: a file is in the way" in capsys.readouterr().err
    shutil.rmtree(tmp_path / "terrain")
    for _ in range(2):  # an earlier export is
        assert run(result, "--columns", 1, "--rows", 1, "-o", tmp_path) == 0


def test_other_peoples_files_are_no_earlier_tile_set(result, tmp_path, capsys):
    (tmp_path / "tiles").mkdir()
    (tmp_path / "tiles/lod0_tile_00.ply").write_bytes(b"mine")
    (tmp_path / "gswt.zip").write_bytes(b"mine")
    for name in ("tiles", "gswt"):
        assert run(result, "--formats", name, "-o", tmp_path) == 1
        assert "is in the way" in capsys.readouterr().err
    assert (tmp_path / "tiles/lod0_tile_00.ply").read_bytes() == (tmp_path / "gswt.zip").read_bytes() == b"mine"
    for _ in range(2):
        assert run(result, "--formats", "tiles", "gswt", "-o", tmp_path / "out") == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["gswt.zip", "tiles"]
