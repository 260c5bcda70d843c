"""Masks: what they hide in pictures and views, and which are refused."""

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.photo_set import MARGIN, undistort_masks, write_photo_folder
from dav_gswt.photos.sfm.registration import Registration
from dav_gswt.photos.training_views import read_training_view


@pytest.fixture
def found(tmp_path):
    """One registered photo, photo.jpg, through a lens without distortion."""
    camera = synth.camera((0, 0, 1))
    image_files.write_png(tmp_path / "photo.png", np.full((camera.height, camera.width, 3), 0.5))
    params = [camera.fx, camera.fy, camera.cx, camera.cy]
    lens = pycolmap.Camera(model="PINHOLE", width=camera.width, height=camera.height, params=params)
    one = synth.model([camera], np.zeros((1, 3)))
    return Registration(one, (tmp_path / "photo.png",), (lens,), (), None, 0.0)


def masked(tmp_path, name="photo.png", shape=(120, 160)):
    """A mask at half the photo's size whose left half is black."""
    (tmp_path / "masks").mkdir(parents=True)
    mask = np.ones((*shape, 3), np.float32)
    mask[:, : shape[1] // 2] = 0
    image_files.write_png(tmp_path / "masks" / name, mask)
    return tmp_path / "masks"


@pytest.mark.parametrize("name", ["photo.png", "photo.png.png"])
def test_black_does_not_count_nor_does_its_edge(found, tmp_path, name):
    cover = undistort_masks(found, masked(tmp_path, name))["000.png"]
    assert not cover[:, : 160 + MARGIN].any()
    assert cover[:, 160 + MARGIN + 1 :].all()


def test_masks_go_with_the_pictures_as_their_alpha_and_views_do_not_count_them(found, tmp_path):
    covers = undistort_masks(found, masked(tmp_path))
    picture = np.random.default_rng(0).uniform(0, 1, (240, 320, 3)).astype(np.float32)
    write_photo_folder(tmp_path / "photos", found.model, [("000.png", picture)], scene_frame(), (), covers)
    path = tmp_path / "photos" / "images" / "000.png"
    np.testing.assert_allclose(image_files.read_photo(path), picture, atol=0.5 / 255 + 1e-6)  # also under the mask
    for size in (320, 160):
        view = read_training_view("000.png", found.model.cameras[0], path, size)
        assert not view.weight[:, : size // 2].any() and view.weight[:, size // 2 + 3 :].all()


def test_masks_of_another_shape_or_of_no_photo_are_refused_by_name(found, tmp_path):
    with pytest.raises(InputError, match=r"photo.png.*160 x 160"):
        undistort_masks(found, masked(tmp_path, shape=(160, 160)))
    with pytest.raises(InputError, match="named like a photo"):
        undistort_masks(found, masked(tmp_path / "others", "other.png"))
