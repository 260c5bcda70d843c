"""A round's photos as other programs read them: cameras, points and pictures, without a trace of the test photos."""

from dataclasses import replace

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.export import photo_model
from dav_gswt.files import digest_files
from dav_gswt.geometry.poses import Pose
from dav_gswt.images import image_files
from dav_gswt.photos.capture_record import CapturedPhoto, list_taken_photos, write_capture_record
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.view_split import ViewSplit

HALF = 1.0
POSE = Pose("c1", 30.0, 40.0, 1.0)
SPLIT = ViewSplit(start=("000.png", "001.png", "004.png"), pool=("002.png", "003.png", "005.png"), test=("006.png",))


@pytest.fixture(scope="module")
def known():
    """Seven photos of 200 points near the ground, matched exactly."""
    rng = np.random.default_rng(5)
    found = synth.model(synth.flight(2, 4)[:7], synth.plain(200, 0.6, rng, relief=0.05))
    return replace(found, colours=np.full(found.points.shape, 0.5, np.float32))


@pytest.fixture(scope="module")
def folder(known, tmp_path_factory):
    """images/, a replayed photo of the pool, and one that a device took under a name that is there."""
    folder, ground = tmp_path_factory.mktemp("photos"), synth.texture(np.random.default_rng(4), 300)
    synth.shoot(folder / "images", known.cameras, ground, HALF)
    other = replace(synth.camera((0.1, 0.2, 1.1), (0, 0, 0)), fx=250.0, cy=100.0)
    for number, (name, camera) in enumerate([("002.png", known.camera("002.png")), ("001.png", other)], 1):
        capture = folder / f"capture{number}"
        capture.mkdir()
        image_files.write_png(capture / name, synth.photograph(camera, ground, HALF))
        write_capture_record(capture, "replay", [CapturedPhoto(name, POSE, camera, camera, 0.0)])
    return folder


@pytest.fixture(scope="module")
def taken(folder, known):
    captures = [folder / "capture1", folder / "capture2"]
    return list_taken_photos(folder / "images", known, SPLIT.start, captures)


@pytest.fixture(scope="module")
def written(taken, folder, known):
    photo_model.write_photo_models(folder / "model", folder / "images", known, SPLIT, taken)
    return folder / "model"


NAMES = ("000.png", "001.png", "004.png", "002.png", "iter2_001.png")


def assert_same(one, other, tolerance=1e-9):
    assert one.rotation == pytest.approx(other.rotation, abs=tolerance)
    assert one.translation == pytest.approx(other.translation, abs=tolerance)
    lenses = [(c.fx, c.fy, c.cx, c.cy, c.width, c.height) for c in (one, other)]
    assert lenses[0] == pytest.approx(lenses[1])


def test_colmap_reads_all_photos_that_were_taken_and_no_other(written, taken):
    stored = pycolmap.Reconstruction(str(written / "sparse/0"))
    assert sorted(image.name for image in stored.images.values()) == sorted(NAMES)
    assert {camera.model_name for camera in stored.cameras.values()} == {"PINHOLE"}
    assert sorted(p.name for p in (written / "images").iterdir()) == sorted(NAMES)
    read = read_colmap_model(written / "sparse/0")
    for photo in taken:
        assert_same(read.camera(photo.name), photo.camera)
        assert digest_files(written / "images" / photo.name) == digest_files(photo.source)


def test_what_the_test_photos_see_leaves_no_trace(written, taken, folder, known, tmp_path):
    unseen = known.image_of == known.names.index("006.png")
    pixels = known.pixels + unseen[:, None] * 30.0
    moved = replace(known, pixels=pixels, points=known.points + unseen.sum(), colours=1 - known.colours)
    photo_model.write_photo_models(tmp_path / "other", folder / "images", moved, SPLIT, taken)
    for name in ("sparse/0/points3D.bin", "sparse/0/images.bin"):
        assert digest_files(written / name) == digest_files(tmp_path / "other" / name), name


def test_a_picture_of_another_size_or_a_name_that_leads_elsewhere_is_named_and_nothing_is_left(
    folder, known, taken, tmp_path
):
    image_files.write_png(tmp_path / "small.png", np.zeros((8, 9, 3), np.float32))
    small, elsewhere = replace(taken[4], source=tmp_path / "small.png"), replace(taken[4], name="../001.png")
    for wrong, why in ((small, "small.png: 9 x 8 pixels, its camera takes 320 x 240"), (elsewhere, "001.png")):
        with pytest.raises(InputError, match=f"{why}.*; make the photos again"):
            photo_model.write_photo_models(tmp_path / "model", folder / "images", known, SPLIT, [*taken[:4], wrong])
        assert not list(tmp_path.glob("*model*"))
