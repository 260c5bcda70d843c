"""Features of photos, the pairs that are matched, and the places of further photos of a known scene."""

import logging

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.files import write_json
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import write_colmap_model
from dav_gswt.photos.sfm import localization
from dav_gswt.photos.sfm.features import (
    compare_descriptions,
    describe_photos,
    select_pairs,
)
from dav_gswt.photos.sfm.localization import localize_photos


def walk(photos, rng, overlap=0.7, each=100):
    """Features of photos along a walk: neighbours share most of theirs."""
    pool = rng.integers(0, 120, (each * photos, 128)).astype(np.uint8)
    step = int(each * (1 - overlap))
    shots = [pool[i * step : i * step + each].astype(int) for i in range(photos)]
    return [np.clip(s + rng.integers(-4, 5, s.shape), 0, 255).astype(np.uint8) for s in shots]


def test_photos_that_overlap_are_matched_whatever_their_names():
    rng = np.random.default_rng(0)
    shots, order = walk(30, rng), rng.permutation(30)
    found = set(select_pairs([shots[i] for i in order], 6, 0))
    assert all(i < j for i, j in found) and len(found) < 30 * 29 / 2 * 0.6
    place = np.argsort(order)
    neighbours = {tuple(sorted((int(place[i]), int(place[i + 1])))) for i in range(29)}
    assert len(neighbours & found) >= 28


def test_the_choice_repeats_and_photos_without_features_do_no_harm():
    shots = [*walk(24, np.random.default_rng(2)), np.zeros((0, 128), np.uint8)]
    one, two = select_pairs(shots, 5, 3), select_pairs(shots, 5, 3)
    assert one == two
    assert np.isfinite(describe_photos(shots, 3)).all()
    assert np.isfinite(describe_photos([np.zeros((0, 128), np.uint8)] * 3, 0)).all()
    alike = compare_descriptions(describe_photos(walk(5, np.random.default_rng(3)), 0))
    np.testing.assert_allclose(np.diag(alike), 1, atol=1e-5)
    assert alike[0, 1] > alike[0, 4]


@pytest.fixture
def known_photos(tmp_path, monkeypatch):
    """A photos/ folder: pictures of a plane from known places, and points on it."""
    monkeypatch.setattr(localization, "FEATURES", 1024)
    out = tmp_path / "photos"
    cameras = synth.flight(2, 2, step=0.2)
    known = synth.model(cameras, synth.plain(4000, 0.8, np.random.default_rng(1)))
    synth.shoot(out / "images", cameras, synth.texture(np.random.default_rng(4)), 1.0)
    (out / "sparse").mkdir()
    write_colmap_model(known, out / "sparse")
    write_json(out / "ground.json", {})
    return out


def test_further_photos_find_their_places_and_others_do_not(known_photos, tmp_path, caplog):
    asked = synth.camera((0.1, 0.05, 0.9), (0.12, 0.1, 0))
    synth.shoot(tmp_path / "new", [asked], synth.texture(np.random.default_rng(4)), 1.0)
    other = synth.photograph(synth.camera((0, 0, 1)), synth.texture(np.random.default_rng(99)), 1.0)
    image_files.write_png(tmp_path / "new" / "other.png", other)
    image_files.write_png(tmp_path / "new" / "square.png", np.full((200, 200, 3), 0.5))
    with caplog.at_level(logging.WARNING):
        found, *none = localize_photos(known_photos, sorted((tmp_path / "new").iterdir()))
    assert none == [None, None] and "square.png" in caplog.text and "same camera" in caplog.text
    assert np.linalg.norm(found.centre - asked.centre) < 0.01
    assert np.degrees(np.arccos(found.forward @ asked.forward)) < 0.5
    assert localize_photos(known_photos, []) == []
