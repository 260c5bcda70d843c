"""Further photos of a scene that is already known."""

import logging

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.files import write_json
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import write_colmap_model
from dav_gswt.photos.sfm.localization import localize_photos

HALF = 1.0


@pytest.fixture(scope="module")
def ground():
    return synth.texture(np.random.default_rng(4))


@pytest.fixture(scope="module")
def photos(tmp_path_factory, ground):
    """A photos/ folder: pictures of a plane from known places, and points on it."""
    out = tmp_path_factory.mktemp("photos")
    cameras = synth.flight(3, 3, step=0.2)
    known = synth.model(cameras, synth.plain(4000, 0.8, np.random.default_rng(1)))
    synth.shoot(out / "images", cameras, ground, HALF)
    (out / "sparse").mkdir()
    write_colmap_model(known, out / "sparse")
    write_json(out / "ground.json", {})
    return out


def test_further_photos_find_their_places_and_others_do_not(photos, ground, tmp_path):
    asked = [
        synth.camera((0.1, 0.05, 0.9), (0.12, 0.1, 0)),
        synth.camera((-0.15, 0.1, 1.1), (-0.1, 0, 0)),
    ]
    synth.shoot(tmp_path, asked, ground, HALF)
    other = synth.photograph(synth.camera((0, 0, 1)), synth.texture(np.random.default_rng(99)), HALF)
    image_files.write_png(tmp_path / "other.png", other)
    found = localize_photos(photos, sorted(tmp_path.iterdir()))
    assert found[2] is None
    for camera, true in zip(found[:2], asked, strict=True):
        assert np.linalg.norm(camera.centre - true.centre) < 0.01
        assert np.degrees(np.arccos(camera.forward @ true.forward)) < 0.5


def test_no_photo_asks_for_nothing(photos):
    assert localize_photos(photos, []) == []


def test_a_photo_of_another_camera_is_named(photos, tmp_path, caplog):
    image_files.write_png(tmp_path / "square.png", np.full((200, 200, 3), 0.5))
    with caplog.at_level(logging.WARNING):
        assert localize_photos(photos, [tmp_path / "square.png"]) == [None]
    assert "square.png" in caplog.text and "same camera" in caplog.text
