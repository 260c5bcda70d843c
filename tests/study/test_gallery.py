"""The gallery: pictures side by side, a walk as a moving picture, and the page's numbers."""

import json

import numpy as np
import pytest
from fixtures.markdown import collapse_spaces
from fixtures.terrains import two_level_terrain
from PIL import Image

from dav_gswt.images import image_files
from dav_gswt.study import gallery

COLOURS = np.eye(3, dtype=np.float32)


def write(path, colour, shape=(90, 160)):
    image_files.write_png(path, np.broadcast_to(np.float32(colour), (*shape, 3)))
    return path


@pytest.fixture
def pictures(tmp_path):
    return [write(tmp_path / f"{k}.png", colour) for k, colour in enumerate(COLOURS)]


def test_a_scene_s_pictures_stand_side_by_side(pictures, tmp_path):
    gallery.draw_scene(*pictures, tmp_path / "row.jpg")
    row = image_files.read_photo(tmp_path / "row.jpg")
    assert row.shape[0] == gallery.HEIGHT
    assert [int(row[150, column].argmax()) for column in (100, 500, 1000)] == [0, 1, 2]


def test_a_walk_plays_its_frames_in_their_order_for_ever(pictures, tmp_path):
    gallery.animate_frames(pictures, 10, tmp_path / "walk.webp")
    with Image.open(tmp_path / "walk.webp") as walk:
        assert (walk.n_frames, walk.info["loop"]) == (3, 0)
        for number in range(3):
            walk.seek(number)
            assert np.asarray(walk.convert("RGB"))[40, 80].argmax() == number
            assert walk.info["duration"] == 100


@pytest.mark.parametrize("width, factor", [(480, 0.25), (1920, 1.0), (3840, 1.0)])
def test_levels_begin_nearer_in_smaller_pictures(width, factor):
    terrain = two_level_terrain()
    made = gallery.suit_width(terrain, width)
    assert made.switches == [factor * value for value in terrain.switches]
    assert made.bands == [factor * value for value in terrain.bands]


def test_a_walk_without_frames_is_refused(tmp_path):
    with pytest.raises(ValueError, match="needs a frame"):
        gallery.animate_frames([], 10, tmp_path / "walk.webp")


def cell(folder, scene, kind):
    mean = {"psnr": 30.0, "psnr_colour_corrected": 31.5, "ssim": 0.9, "lpips": 0.05}
    metrics = mean | {"groups": {}, "worst_decile": mean, "photos": 16, "gaussians": 9000}
    (folder / "metrics.json").write_text(json.dumps(metrics | {"provenance": {"version": "1.2"}}))
    chunks = [{"chunks": [{"bytes": 2_000_000}]}]
    (folder / "davgswt.json").write_text(json.dumps({"tiles": chunks, "objects": chunks}))
    files = {"metrics": str(folder / "metrics.json"), "manifest": str(folder / "davgswt.json"), "materials": None}
    return {"scene": scene, "kind": kind} | files


def test_the_page_has_every_scene_with_its_numbers(tmp_path):
    rows = [gallery.tabulate_scene(cell(tmp_path, *which)) for which in (("my_sand", "photos"), ("dune", "synthetic"))]
    rows[0] |= {"grade": "good", "reason": "1 material"}
    page = collapse_spaces(gallery.format_gallery(rows, "my_sand", 20.0))
    assert "version 1.2" in page and "A walk of 20 seconds over the terrain of my_sand](figures/walk.webp)" in page
    assert "Made from 16 photos. Verdict on its ground: *good*: 1 material." in page
    assert "Made from 16 rendered photos of synthetic ground.\n" in page
    assert "| my_sand | 16 | 31.50 | 0.900 | 0.050 | 9000 | 4.0 |" in page
    assert "| dune | 16 | 30.00 | 0.900 | 0.050 | 9000 | 4.0 |" in page
    assert "](figures/gallery_my_sand.jpg)" in page
