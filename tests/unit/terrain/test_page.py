"""Page folders: whole or not at all, of sound bundles alone; the front, of which nothing becomes HTML; the story."""

import json

import numpy as np
import pytest
from fixtures import bundles
from fixtures.land_covers import write_cover_bundle

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square, write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import TakenPhoto
from dav_gswt.terrain import page
from dav_gswt.terrain.heights import make_sphere
from dav_gswt.terrain.page import Front, Story, fill_front, front_of_scene, tell_story, write_page

SOURCE = (
    '<meta content="An endless terrain made from a few photos"><title>Endless terrain</title><!-- modules -->'
    '<!-- first --><h1 id="name">Endless terrain</h1><p id="line">An endless terrain made from a few photos</p>'
)


@pytest.fixture
def viewer(tmp_path):
    folder = tmp_path / "viewer"
    folder.mkdir()
    (folder / "index.html").write_text("<html><!-- modules --><!-- first --></html>")
    (folder / "draw").mkdir()
    (folder / "draw" / "main.js").write_text("//")
    return folder


@pytest.fixture
def bundle(tmp_path):
    bundles.write_bundle(tmp_path / "bundle", bundles.Ground(discs=2))
    (tmp_path / "bundle" / "parts" / "not-named.bin").write_bytes(b"old")
    return tmp_path / "bundle"


def names(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def test_a_page_is_the_viewer_the_manifest_and_the_parts_it_names(tmp_path, viewer, bundle):
    (tmp_path / "terrain" / ".page.part").mkdir(parents=True)  # what a killed run left behind
    parts = ["parts/records0.bin", "parts/records1.bin"]
    for _ in range(2):
        write_page(bundle, viewer, tmp_path / "terrain" / "page")
        assert names(tmp_path / "terrain") == [
            f"page/{n}" for n in ("davgswt.json", "draw/main.js", "index.html", *parts)
        ]
        (tmp_path / "terrain/page/old.js").write_text("gone soon")
    assert (tmp_path / "terrain/page" / parts[0]).read_bytes() == (bundle / parts[0]).read_bytes()
    assert 'href="draw/main.js"' in (tmp_path / "terrain/page/index.html").read_text()


def test_the_front_of_a_scene_is_beside_its_page(root, tmp_path, viewer, bundle):
    (viewer / "index.html").write_text((root / "workflow/viewer/index.html").read_text())
    story = Story({"grade": None, "rounds": [], "photos": []}, b"sheet")
    write_page(bundle, viewer, tmp_path / "page", front=Front("Desert", "A line", b"still", story=story))
    assert (tmp_path / "page/first.jpg").read_bytes() == b"still"
    assert (tmp_path / "page/photos.jpg").read_bytes() == b"sheet"
    assert json.loads((tmp_path / "page/story.json").read_text()) == story.value


def test_a_missing_part_is_named(tmp_path, viewer, bundle):
    (bundle / "parts" / "records1.bin").unlink()
    with pytest.raises(InputError, match=r"records1\.bin: this part is missing"):
        write_page(bundle, viewer, tmp_path / "page")
    assert not (tmp_path / "page").exists()


def surface_of(folder):
    return json.loads((folder / "davgswt.json").read_text())["heights"]


def test_the_page_of_a_planet_takes_no_objects(tmp_path, viewer, bundle):
    write_page(bundle, viewer, tmp_path / "round", make_sphere(10.0, 2.0))
    assert surface_of(tmp_path / "round") == {"kind": "sphere", "radius": 20.0, "cells": 14}
    assert "heights" not in json.loads((bundle / "davgswt.json").read_text())
    write_cover_bundle(tmp_path / "cover")
    with pytest.raises(InputError, match="materials: one"):
        write_page(tmp_path / "cover", viewer, tmp_path / "page", make_sphere(10.0, 2.0))
    assert not (tmp_path / "page").exists()


def test_name_line_still_and_modules_are_in_the_page_as_text():
    filled = fill_front(SOURCE, Front("<script>", '"&', b""), ["main.js", 'ui/a".js'])
    name, line = "&lt;script&gt;", "&quot;&amp;"
    assert f"<title>{name} · {line}</title>" in filled and f'<h1 id="name">{name}</h1>' in filled
    assert f'content="{name}: {line}"' in filled and f'<p id="line">{line}</p>' in filled
    assert '<img id="first" src="first.jpg" alt="">' in filled
    assert filled.count("modulepreload") == 2 and "ui/a&quot;.js" in filled and "<!--" not in filled


def test_a_still_is_small_and_the_same_each_time(tmp_path):
    image_files.write_png(tmp_path / "smooth.png", np.tile(np.linspace(0, 1, 640)[None, :, None], (360, 1, 3)))
    fronts = [front_of_scene("desert", None, tmp_path / "smooth.png") for _ in range(2)]
    assert fronts[0] == fronts[1] and len(fronts[0].still) < page.STILL_BYTES
    (tmp_path / "still.jpg").write_bytes(fronts[0].still)
    assert image_files.read_size(tmp_path / "still.jpg") == (640, 360)
    seen = image_files.read_photo(tmp_path / "still.jpg")
    assert abs(seen - image_files.read_photo(tmp_path / "smooth.png")).mean() < 0.01


@pytest.fixture
def made(tmp_path, monkeypatch):
    """What a round of two photos at the start and one captured leaves."""
    images = tmp_path / "images"
    images.mkdir()
    for name in ("a.png", "b.png", "c.png"):
        image_files.write_png(images / name, np.full((30, 40, 3), 0.5))
    eyes = {"a.png": (1.0, 2.0, 3.0), "b.png": (-1.0, 0.0, 3.0), "c.png": (0.0, -4.0, 5.0)}
    taken = [
        TakenPhoto(name, images / name, cameras.pinhole(np.array(eye), np.zeros(3), 40, 30, 60.0), int(name == "c.png"))
        for name, eye in eyes.items()
    ]
    monkeypatch.setattr(page, "list_photos", lambda given: taken)
    write_scene_frame(
        tmp_path / "ground.json",
        SceneFrame("synthetic", "metre", 3.0, Square(-2.0, -2.0, 4.0), Extent(-5.0, -5.0, 5.0, 5.0), images=3),
    )
    for number, psnr in enumerate((27.123, None)):
        (tmp_path / f"{number}.json").write_text(json.dumps({"psnr": psnr}))
    metrics = [tmp_path / "0.json", tmp_path / "1.json"]
    return {"views": "views.json", "frame": tmp_path / "ground.json", "metrics": metrics}


def test_places_rounds_and_pictures_are_told(made):
    story = tell_story(made)
    assert story.value["rounds"] == [{"photos": 2, "psnr": 27.12}, {"photos": 1, "psnr": None}]
    assert [photo["at"] for photo in story.value["photos"]] == [[1, 2, 3], [-1, 0, 3], [0, -4, 5]]
    assert [photo["picture"] for photo in story.value["photos"]] == [0, 1, 2]
    assert story.value["photos"][1]["look"][0] > 0, "it looks at the middle, which lies to the east"
    assert story.value["grade"] is None and story.value["half"] == 2 and story.sheet[:3] == b"\xff\xd8\xff"
    assert story == tell_story(made) and tell_story({"views": None}) is None, "a finished field has none"
