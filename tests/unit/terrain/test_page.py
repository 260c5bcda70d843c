"""The page folder appears whole or not at all, and nothing but a sound bundle gets into it."""

import json

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.terrain import page
from dav_gswt.terrain.heights import HeightMap, Hills
from dav_gswt.terrain.page import write_page
from dav_gswt.terrain.sphere import make_sphere


@pytest.fixture
def viewer(tmp_path):
    folder = tmp_path / "viewer"
    folder.mkdir()
    (folder / "index.html").write_text("<html><!-- modules --><!-- first --></html>")
    (folder / "main.js").write_text("//")
    return folder


@pytest.fixture
def bundle(tmp_path):
    folder = tmp_path / "bundle"
    (folder / "chunks").mkdir(parents=True)
    (folder / "chunks" / "a.bin").write_bytes(b"1234")
    (folder / "chunks" / "not-named.bin").write_bytes(b"old")
    rewrite(folder, {"file": "chunks/a.bin", "bytes": 4})
    return folder


def rewrite(folder, chunk, version=3):
    manifest = {"format": "davgswt", "version": version, "tiles": [{"tile": 0, "chunks": [chunk]}]}
    (folder / "davgswt.json").write_text(json.dumps(manifest))


def names(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def test_a_page_is_the_viewer_the_manifest_and_the_chunks_it_names(tmp_path, viewer, bundle):
    write_page(bundle, viewer, tmp_path / "terrain" / "page")
    assert names(tmp_path / "terrain") == [
        f"page/{n}" for n in ("chunks/a.bin", "davgswt.json", "index.html", "main.js")
    ]
    assert (tmp_path / "terrain/page/chunks/a.bin").read_bytes() == b"1234"


def test_a_new_page_takes_the_place_of_the_old_one(tmp_path, viewer, bundle):
    out = tmp_path / "page"
    write_page(bundle, viewer, out)
    (out / "old.js").write_text("gone soon")
    write_page(bundle, viewer, out)
    assert "old.js" not in names(out)


def test_what_a_killed_run_left_behind_is_cleared(tmp_path, viewer, bundle):
    (tmp_path / ".page.part").mkdir()
    (tmp_path / ".page.part" / "half").write_text("")
    write_page(bundle, viewer, tmp_path / "page")
    assert "half" not in names(tmp_path / "page") and not (tmp_path / ".page.part").exists()


def test_a_failure_in_the_middle_leaves_the_old_page_and_nothing_half_made(tmp_path, viewer, bundle, monkeypatch):
    out = tmp_path / "page"
    write_page(bundle, viewer, out)
    before = names(tmp_path)

    def full(source, target):
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr(page, "_copy_file", full)
    with pytest.raises(OSError, match="No space left"):
        write_page(bundle, viewer, out)
    assert names(tmp_path) == before


@pytest.mark.parametrize(
    "chunk, message",
    [
        pytest.param({"file": "chunks/b.bin", "bytes": 4}, r"b\.bin: this chunk is missing", id="missing"),
        pytest.param({"file": "chunks/a.bin", "bytes": 5}, r"a\.bin: 4 bytes instead of 5", id="cut short"),
        pytest.param({"file": "../secret", "bytes": 4}, "lies outside", id="upwards"),
        pytest.param({"file": "/etc/hostname", "bytes": 4}, "lies outside", id="absolute"),
        pytest.param({"file": "", "bytes": 4}, "lies outside", id="no name"),
        pytest.param({"bytes": 4}, "incomplete tile table", id="no entry"),
    ],
)
def test_an_unsound_chunk_is_refused_by_name(tmp_path, viewer, bundle, chunk, message):
    (tmp_path / "secret").write_bytes(b"1234")
    rewrite(bundle, chunk)
    with pytest.raises(InputError, match=message):
        write_page(bundle, viewer, tmp_path / "page")
    assert not (tmp_path / "page").exists()


def test_another_version_is_refused(tmp_path, viewer, bundle):
    rewrite(bundle, {"file": "chunks/a.bin", "bytes": 4}, version=1)
    with pytest.raises(InputError, match=r"davgswt\.json: not a bundle of format 'davgswt', version 3"):
        write_page(bundle, viewer, tmp_path / "page")


def test_the_viewer_is_the_folder_of_index_html(tmp_path):
    files = ["data/a.js", "index.html", "main.js"]
    assert page.find_viewer([str(tmp_path / name) for name in files]) == tmp_path
    with pytest.raises(InputError, match=r"no index\.html"):
        page.find_viewer(["data/a.js"])


def test_modules_in_folders_are_copied_as_they_lie(tmp_path, viewer, bundle):
    (viewer / "draw").mkdir()
    (viewer / "draw" / "sky.js").write_text("export {}")
    write_page(bundle, viewer, tmp_path / "page")
    assert (tmp_path / "page" / "draw" / "sky.js").read_text() == "export {}"


def test_a_viewer_without_its_page_is_refused(tmp_path, viewer, bundle):
    (viewer / "index.html").unlink()
    with pytest.raises(InputError, match="no viewer here"):
        write_page(bundle, viewer, tmp_path / "page")


def surface_of(folder):
    return json.loads((folder / "davgswt.json").read_text())["heights"]


def test_the_page_knows_the_surface_and_the_bundle_does_not(tmp_path, viewer, bundle):
    write_page(bundle, viewer, tmp_path / "flat")
    write_page(bundle, viewer, tmp_path / "hilly", Hills(0.5, 3.0, 2, 9))
    assert surface_of(tmp_path / "flat") == {"kind": "flat"}
    hills = {"kind": "hills", "height": 0.5, "wavelength": 3.0, "octaves": 2, "salt": 9}
    assert surface_of(tmp_path / "hilly") == hills
    assert "heights" not in json.loads((bundle / "davgswt.json").read_text())


def test_the_page_of_a_planet_knows_its_radius_and_cells_and_takes_no_objects(tmp_path, viewer, bundle):
    write_page(bundle, viewer, tmp_path / "round", make_sphere(10.0, 2.0))
    assert surface_of(tmp_path / "round") == {"kind": "sphere", "radius": 20.0, "cells": 14}
    manifest = json.loads((bundle / "davgswt.json").read_text())
    (bundle / "davgswt.json").write_text(json.dumps(manifest | {"objects": [{"chunks": []}]}))
    with pytest.raises(InputError, match="materials: one"):
        write_page(bundle, viewer, tmp_path / "page", make_sphere(10.0, 2.0))
    assert not (tmp_path / "page").exists()


def test_a_height_map_comes_with_its_pixels(tmp_path, viewer, bundle):
    pixels = np.arange(6, dtype=np.float32).reshape(2, 3)
    write_page(bundle, viewer, tmp_path / "page", HeightMap(pixels, 7.5, "clamp"))
    entry = surface_of(tmp_path / "page")
    stored = np.frombuffer((tmp_path / "page" / entry["file"]).read_bytes(), "<f4").reshape(2, 3)
    assert (stored == pixels).all() and entry["bytes"] == 24
    assert (entry["rows"], entry["columns"], entry["width"], entry["beyond"]) == (2, 3, 7.5, "clamp")
