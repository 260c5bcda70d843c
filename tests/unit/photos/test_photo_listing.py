"""Which files are a scene's photos and masks, what masks hide, and positions of photos by a geo.txt."""

import os
import unicodedata
from pathlib import Path

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.geo_file import read_geo_files
from dav_gswt.photos.photo_listing import drop_twins, list_photos
from dav_gswt.photos.photo_set import MARGIN, PhotoMasks, find_borders, prepare_photos, read_picture, write_photo_folder
from dav_gswt.photos.sfm import gps
from dav_gswt.photos.sfm.registration import Registration, SfmOptions
from dav_gswt.photos.training_views import read_training_view

JPEG, HEIC, TIFF = b"\xff\xd8\xff\xe0", b"\0\0\0\x18ftypheic" + b"0" * 40, b"II*\0"


def write(folder, *names, content=JPEG):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def masks(listing) -> dict[str, str]:
    return {photo.name: "/".join(mask.parts[-2:]) for photo, mask in listing.masks.items()}


def test_photos_lie_in_subfolders_and_hidden_files_other_files_and_terrains_are_none(tmp_path):
    write(tmp_path, "b.JPG", "101MEDIA/a.jpg", ".hidden.jpg", ".trash/c.jpg", "notes.txt", "old-terrain/page/d.jpg")
    write(tmp_path, "notes.txt", "old-terrain/scene.yaml", "empty.jpg", content=b"")
    listing = list_photos(tmp_path)
    assert list(listing.photos) == ["101MEDIA/a.jpg", "b.JPG", "empty.jpg"]  # a damaged photo is reported, not hidden
    assert [path.name for path in listing.files["other"]] == ["notes.txt"] and not listing.notes
    with pytest.raises(InputError, match="nowhere: there is no such folder"):
        list_photos(tmp_path / "nowhere")


def test_several_folders_and_files_are_one_set(tmp_path):
    write(tmp_path, "one/1.jpg", "two/1.jpg", "on/3.jpg", "on/3_mask.jpg", "on/4.jpg", "masks/4.png")
    places = ["one", "two", "on/3.jpg", "on/3_mask.jpg", "on/4.jpg", "masks"]  # as a shell's * gives them
    listing = list_photos([tmp_path / place for place in places])
    assert list(listing.photos) == ["one/1.jpg", "two/1.jpg", "on/3.jpg", "on/4.jpg"]
    assert masks(listing) == {"3.jpg": "on/3_mask.jpg", "4.jpg": "masks/4.png"}


def test_a_raw_photo_or_heic_beside_its_jpeg_is_the_same_picture(tmp_path):
    write(tmp_path, "1.jpg", "2.jpg", "day2/3.jpg")
    write(tmp_path, "1.dng", "3.dng", content=TIFF)
    write(tmp_path, "2.heic", content=HEIC)
    listing = list_photos(tmp_path)
    assert list(listing.photos) == ["1.jpg", "2.jpg", "3.dng", "day2/3.jpg"]
    assert listing.notes[0].endswith("are skipped: 2")


def test_masks_beside_photos_in_a_folder_in_it_and_in_one_beside_images(tmp_path):
    write(tmp_path, "a/1.JPG", "a/1_mask.JPG", "a/old_mask.jpg", "b/masks/1.png", "b/1.jpg")
    write(tmp_path, "c/images/s/1.jpg", "c/images/t/1.jpg", "c/masks/s/1.jpg.png", "c/masks/t/1.jpg.png")
    one = list_photos(tmp_path / "a")
    assert list(one.photos) == ["1.JPG", "old_mask.jpg"] and masks(one) == {"1.JPG": "a/1_mask.JPG"}
    assert masks(list_photos(tmp_path / "b")) == {"1.jpg": "masks/1.png"}
    pairs = list_photos(tmp_path / "c/images").masks.items()
    assert [(photo.parent.name, mask.parent.name) for photo, mask in pairs] == [("s", "s"), ("t", "t")]
    assert masks(list_photos(tmp_path / "a", tmp_path / "b/masks")) == {"1.JPG": "masks/1.png"}
    write(tmp_path, "b/masks/1.png", "d/masks/other.png", "d/1.jpg")
    assert "belongs to no photo" in list_photos(tmp_path / "d").notes[0]


def test_a_name_that_is_no_utf8_is_named_and_skipped_and_letters_are_composed(tmp_path):
    decomposed = unicodedata.normalize("NFD", "düne.jpg")
    write(tmp_path, decomposed, "{a} b.jpg")
    try:
        Path(os.fsdecode(bytes(tmp_path) + b"/d\xfcne.jpg")).write_bytes(JPEG)
    except OSError:
        pytest.skip("this file system takes no such name")
    listing = list_photos(tmp_path)
    assert set(listing.photos) == {"düne.jpg", "{a} b.jpg"}
    assert listing.photos["düne.jpg"].name == decomposed
    assert r"no UTF-8 are skipped: 1, such as d\xfcne.jpg; rename" in listing.notes[0]


def test_each_content_counts_once_under_the_shortest_name(tmp_path):
    write(tmp_path, "IMG_1 (1).jpg", "IMG_1.jpg", "b/IMG_1.jpg")
    write(tmp_path, "IMG_2.jpg", content=JPEG + b"2")
    kept, twins = drop_twins(list_photos(tmp_path).photos)
    assert list(kept) == ["IMG_1.jpg", "IMG_2.jpg"]
    assert twins == {"IMG_1 (1).jpg": "IMG_1.jpg", "b/IMG_1.jpg": "IMG_1.jpg"}


@pytest.mark.parametrize(
    ("first", "x", "y"),
    [
        ("EPSG:4326", 9.0, 0.0),
        ("WGS84 UTM 32N", 500_000, 0),
        ("+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs", 500_000, 0),
    ],
)
def test_a_geo_txt_beside_the_photos_is_read(tmp_path, first, x, y):
    (tmp_path / "geo.txt").write_text(f"{first}\na.jpg {x} {y} 520.5 0 0 0 2 2\n\nb.jpg {x} {y}\nother.jpg {x} {y} 1\n")
    a, b = tmp_path / "a.jpg", tmp_path / "b.jpg"
    found = read_geo_files([a, b, tmp_path / "c.jpg"])
    assert list(found) == [a, b] and found[a] == pytest.approx((0.0, 9.0, 520.5), abs=1e-6)  # the middle of zone 32
    assert np.isnan(found[b][2])


def test_a_geo_txt_may_lie_beside_the_folder_images_and_counts_before_exif(tmp_path, monkeypatch):
    photos = [tmp_path / "images" / f"{i}.jpg" for i in range(4)]
    photos[0].parent.mkdir()
    rows = [f"{i}.jpg 9.0 {0.001 * i} 520" for i in range(4)]
    (tmp_path / "geo.txt").write_text("\n".join(["EPSG:4326", *rows]))
    monkeypatch.setattr(gps, "read_gps_position", lambda path: (1.0, 2.0, 3.0))
    found = gps.read_gps_positions(photos)
    assert (found.about.longitude, found.about.altitude) == (9.0, 520.0)
    assert found.at[:, 1] == pytest.approx(110.6 * np.array([-1.5, -0.5, 0.5, 1.5]), rel=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("+proj=utm +zone=32 +nadgrids=/etc/passwd\n", "line 1: .* no projection that is read"),
        ("EPSG:999999\n", "line 1: .* no projection"),
        ("", "line 1"),
        ("EPSG:4326\na.jpg 11.0\n", "line 2: is not `photo.jpg x y altitude`"),
        ("EPSG:4326\n\na.jpg east 48\n", "line 3"),
        ("EPSG:4326\na.jpg 649226 5318378\n", "line 2: no place on earth by 'EPSG:4326'"),
    ],
)
def test_a_geo_txt_that_is_none_is_named_with_its_line(tmp_path, text, message):
    (tmp_path / "geo.txt").write_text(text)
    with pytest.raises(InputError, match=f"geo.txt: {message}"):
        read_geo_files([tmp_path / "a.jpg"])


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
