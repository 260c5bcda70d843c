"""The front of a page: names, lines and stills, and that nothing a scene is called becomes HTML."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.terrain import page_front
from dav_gswt.terrain.page_front import Front, encode_still, fill_front, line_of_photos, name_of_scene
from dav_gswt.terrain.page_story import Story

SOURCE = (
    '<meta content="An endless terrain made from a few photos"><title>Endless terrain</title><!-- modules -->'
    '<!-- first --><h1 id="name">Endless terrain</h1><p id="line">An endless terrain made from a few photos</p>'
)


@pytest.mark.parametrize("scene, name", [("desert", "Desert"), ("my_own-meadow", "My own meadow"), ("_", "")])
def test_a_key_becomes_a_title(scene, name):
    assert name_of_scene(scene) == name


def test_the_line_says_what_the_terrain_is_made_from():
    assert line_of_photos(1).endswith("made from 1 photo") and line_of_photos(16).endswith("made from 16 photos")
    assert line_of_photos(0).endswith("made from a Gaussian field")


def test_name_line_still_and_modules_are_in_the_page():
    filled = fill_front(SOURCE, Front("Desert", "A line", b""), ["main.js", "ui/hud.js"])
    assert "<title>Desert · A line</title>" in filled and '<h1 id="name">Desert</h1>' in filled
    assert '<img id="first" src="first.jpg" alt="">' in filled and 'content="Desert: A line"' in filled
    assert filled.count("modulepreload") == 2 and "<!--" not in filled


def test_without_a_front_the_page_keeps_its_own_texts_and_asks_for_no_still():
    filled = fill_front(SOURCE, None, [])
    assert "first.jpg" not in filled and "<title>Endless terrain</title>" in filled


@pytest.mark.parametrize(
    "value, text",
    [
        ({"grade": None, "rounds": [{"psnr": None}]}, ""),
        ({"grade": "good", "rounds": []}, "The photos fit together well."),
        (
            {"grade": "doubtful", "rounds": [{"psnr": 20.0}, {"psnr": 31.88}, {"psnr": None}]},
            "It is doubtful that the photos fit together. Photos that were not used are predicted to 31.9 dB.",
        ),
    ],
)
def test_the_verdict_is_what_tests_said(value, text):
    front = Front("Desert", "A line", b"", Story(value, b""))
    assert front.to_dict() == {"name": "Desert", "line": "A line", "verdict": text}
    assert Front("Desert", "A line", b"").to_dict()["verdict"] == ""


def test_what_a_scene_is_called_is_text():
    filled = fill_front(SOURCE, Front("<script>", '"&', b""), ['a".js'])
    assert "<script>" not in filled and 'content="&lt;script&gt;: &quot;&amp;"' in filled and "a&quot;.js" in filled


@pytest.mark.parametrize("source", [SOURCE.replace("<!-- first -->", ""), SOURCE + SOURCE])
def test_a_viewer_without_the_places_is_refused(source):
    with pytest.raises(InputError, match="must hold"):
        fill_front(source, None, [])


def test_a_still_is_small_and_the_same_each_time(tmp_path):
    image = np.random.default_rng(0).random((900, 1600, 3)).astype(np.float32)
    image_files.write_png(tmp_path / "noise.png", image)
    image_files.write_png(tmp_path / "smooth.png", np.tile(np.linspace(0, 1, 640)[None, :, None], (360, 1, 3)))
    still = encode_still(tmp_path / "smooth.png")
    assert len(still) < page_front.STILL_BYTES and still == encode_still(tmp_path / "smooth.png")
    (tmp_path / "still.jpg").write_bytes(still)
    assert image_files.read_size(tmp_path / "still.jpg") == (640, 360)
    seen = image_files.read_photo(tmp_path / "still.jpg")
    assert abs(seen - image_files.read_photo(tmp_path / "smooth.png")).mean() < 0.01
    (tmp_path / "noise.jpg").write_bytes(encode_still(tmp_path / "noise.png"))
    assert image_files.read_size(tmp_path / "noise.jpg") == (1280, 720)
