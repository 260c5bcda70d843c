"""The story of a page: which photos, where, and what tests said."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from dav_gswt.geometry import cameras
from dav_gswt.geometry.scene_frame import Extent, SceneFrame, Square, read_scene_frame, write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.photos.taken_photos import TakenPhoto
from dav_gswt.terrain import page_story
from dav_gswt.terrain.page_story import draw_sheet, make_small, spread, tell_story


def test_a_finished_field_has_no_story():
    assert tell_story({}) is None and tell_story({"views": None}) is None


@pytest.mark.parametrize("count, most, found", [(0, 5, []), (3, 5, [0, 1, 2]), (9, 3, [0, 4, 8]), (1, 1, [0])])
def test_photos_that_are_shown_are_spread_over_all(count, most, found):
    assert spread(count, most) == found


def test_a_sheet_holds_each_photo_in_the_middle_of_its_square():
    wide, tall = np.full((60, 240, 3), 1, np.float32), np.full((40, 20, 3), 0.5, np.float32)
    sheet = draw_sheet([make_small(photo) for photo in [wide] * 8 + [tall]])
    thumb = page_story.THUMB
    assert sheet.shape == (2 * thumb, 8 * thumb, 3)
    assert (sheet[thumb // 2, :thumb] == 1).all() and (sheet[:40, :thumb] == 0).all()
    below = sheet[thumb:, :thumb]
    assert (below[40:80, 50:70] == 0.5).all() and below.sum() == pytest.approx(0.5 * 40 * 20 * 3)


@pytest.fixture
def made(tmp_path, monkeypatch):
    """What a round of two photos at the start and one captured leaves, with the cameras given."""
    from dav_gswt.geometry.scene_frame import write_scene_frame

    images = tmp_path / "images"
    images.mkdir()
    for name in ("a.png", "b.png", "c.png"):
        image_files.write_png(images / name, np.full((30, 40, 3), 0.5))
    eyes = {"a.png": (1.0, 2.0, 3.0), "b.png": (-1.0, 0.0, 3.0), "c.png": (0.0, -4.0, 5.0)}
    taken = [
        TakenPhoto(name, images / name, cameras.pinhole(np.array(eye), np.zeros(3), 40, 30, 60.0), int(name == "c.png"))
        for name, eye in eyes.items()
    ]
    monkeypatch.setattr(page_story, "list_photos", lambda given: taken)
    write_scene_frame(
        tmp_path / "ground.json",
        SceneFrame("synthetic", "metre", 3.0, Square(-2.0, -2.0, 4.0), Extent(-5.0, -5.0, 5.0, 5.0), images=3),
    )
    for number, psnr in enumerate((27.123, None)):
        (tmp_path / f"{number}.json").write_text(json.dumps({"psnr": psnr}))
    return {
        "views": "views.json",
        "images": images,
        "model": "sparse",
        "frame": tmp_path / "ground.json",
        "captures": ["capture"],
        "metrics": [tmp_path / "0.json", tmp_path / "1.json"],
    }


def test_of_real_photos_the_psnr_after_their_exposure_is_fitted_is_told(made):
    frame = read_scene_frame(made["frame"])
    write_scene_frame(made["frame"], replace(frame, kind="photos"))
    made["metrics"][0].write_text(json.dumps({"psnr": 20.0, "psnr_colour_corrected": 27.5}))
    assert [each["psnr"] for each in tell_story(made).value["rounds"]] == [27.5, None]


def test_places_rounds_and_pictures_are_told(made):
    story = tell_story(made)
    assert story.value["rounds"] == [{"photos": 2, "psnr": 27.12}, {"photos": 1, "psnr": None}]
    assert [photo["at"] for photo in story.value["photos"]] == [[1, 2, 3], [-1, 0, 3], [0, -4, 5]]
    assert [photo["picture"] for photo in story.value["photos"]] == [0, 1, 2]
    assert story.value["photos"][1]["look"][0] > 0, "it looks at the middle, which lies to the east"
    assert story.value["grade"] is None and story.value["half"] == 2 and story.sheet[:3] == b"\xff\xd8\xff"
    assert story == tell_story(made)


def test_photos_that_contradicted_the_others_are_not_told(tmp_path, monkeypatch):
    import dav_gswt.photos.colmap_model as colmap_model
    import dav_gswt.photos.taken_photos as taken_photos

    camera = cameras.pinhole(np.array([0.0, 0.0, 3.0]), np.zeros(3), 40, 30, 60.0)
    shots = {"first": ["c.png"], "second": ["d.png", "e.png"]}
    monkeypatch.setattr(colmap_model, "read_colmap_model", lambda path: SimpleNamespace(camera=lambda name: camera))
    monkeypatch.setattr(
        taken_photos, "read_capture_record", lambda path: [SimpleNamespace(name=n, camera=camera) for n in shots[path]]
    )
    (tmp_path / "views.json").write_text(json.dumps({"start": ["a.png"], "test": [], "pool": []}))
    fits = []
    for name, taken in zip(shots, (True, False), strict=True):
        fits.append(tmp_path / f"{name}.json")
        report = {"taken": taken, "views": [{"view": view} for view in shots[name]]}
        fits[-1].write_text(json.dumps({"new_views": report}))
    given = {
        "views": tmp_path / "views.json",
        "images": "images",
        "model": "sparse",
        "captures": list(shots),
        "fits": fits,
    }
    assert [(photo.name, photo.round) for photo in page_story.list_photos(given)] == [("a.png", 0), ("c.png", 1)]
