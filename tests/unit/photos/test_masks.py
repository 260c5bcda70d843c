"""Masks: what they hide in pictures and views, and which are refused."""

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.photo_listing import list_photos
from dav_gswt.photos.photo_set import MARGIN, PhotoMasks, find_borders, prepare_photos, read_picture, write_photo_folder
from dav_gswt.photos.sfm.registration import Registration, SfmOptions
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


def masks_of(path):
    return PhotoMasks(list_photos(path, path / "masks").masks, {})


@pytest.mark.parametrize("name", ["photo.png", "photo.png.png"])
def test_black_does_not_count_nor_does_its_edge(found, tmp_path, name):
    masked(tmp_path, name)
    picture, by = read_picture(found, masks_of(tmp_path), 0)
    assert by == ("files",) and not picture[:, : 160 + MARGIN, 3].any()
    assert picture[:, 160 + MARGIN + 1 :, 3].all()


def test_masks_go_with_the_pictures_as_their_alpha_and_views_do_not_count_them(found, tmp_path):
    masked(tmp_path)
    picture, _ = read_picture(found, masks_of(tmp_path), 0)
    picture[..., :3] = np.random.default_rng(0).uniform(0, 1, (240, 320, 3))
    write_photo_folder(tmp_path / "photos", found.model, [("000.png", picture)], scene_frame())
    path = tmp_path / "photos" / "images" / "000.png"
    stored = image_files.read_photo(path)
    np.testing.assert_allclose(stored, picture[..., :3], atol=0.5 / 255 + 1e-6)  # also under the mask
    for size in (320, 160):
        view = read_training_view("000.png", found.model.cameras[0], path, size)
        assert not view.weight[:, : size // 2].any() and view.weight[:, size // 2 + 3 :].all()


def test_a_mask_of_another_shape_is_refused_by_name(found, tmp_path):
    masked(tmp_path, shape=(160, 160))
    with pytest.raises(InputError, match=r"masks/photo.png: is 160 x 160, its photo 320 x 240"):
        read_picture(found, masks_of(tmp_path), 0)


def test_a_folder_of_masks_of_no_photo_is_refused_before_the_work(found, tmp_path):
    with pytest.raises(InputError, match="named like a photo"):
        prepare_photos(tmp_path, tmp_path / "out", SfmOptions(), masks=masked(tmp_path / "others", "other.png"))


def test_alpha_masks_and_a_photo_without_any_has_none(found, tmp_path):
    assert read_picture(found, PhotoMasks({}, {}), 0)[0].shape == (240, 320, 3)
    pixels = np.ones((240, 320, 4), np.float32)
    pixels[:100, :, 3] = 0
    image_files.write_png(tmp_path / "photo.png", pixels)
    picture, by = read_picture(found, PhotoMasks({}, {}), 0)
    assert (
        by == ("their alpha",) and not picture[: 100 + MARGIN, :, 3].any() and picture[100 + MARGIN + 1 :, :, 3].all()
    )


def test_black_corners_that_all_photos_share_are_their_empty_border(found, tmp_path):
    """Photos that another program undistorted, and a dark hole in one of them that is ground."""
    rng, paths = np.random.default_rng(0), []
    for i in range(4):
        picture = rng.uniform(0.2, 1, (240, 320, 3))
        picture[:40, :60] = picture[-30:, -30:] = 0
        picture[100:140, 100:140] = picture[: 10 * (i == 0)] = 0
        paths.append(tmp_path / f"{i}.png")
        image_files.write_png(paths[-1], picture)
    border = find_borders(paths)[320, 240]
    assert (
        not border[:41, :61].any() and not border[-31:, -31:].any() and border[42:209].all() and border[:, 62:289].all()
    )
    image_files.write_png(tmp_path / "photo.png", np.full((240, 320, 3), 0.5))
    picture, by = read_picture(found, PhotoMasks({}, {(320, 240): border}), 0)
    assert by == ("black borders",) and not picture[:40, :60, 3].any() and picture[120, 160, 3] == 1
    assert not find_borders([*paths[:3], tmp_path / "photo.png"]) and not find_borders(paths[:2])
