"""Reading, writing and shrinking images, and float maps in EXR."""

import resource
import struct
import zlib

import numpy as np
import OpenImageIO as oiio
import pytest

from dav_gswt.errors import InputError
from dav_gswt.images import image_files

GENERATOR = np.random.default_rng(0)
PICTURE = GENERATOR.integers(0, 256, (6, 9, 3)).astype(np.uint8)


def stored(path, pixels, **attributes):
    """Write pixels by OpenImageIO, with header attributes."""
    pixels = np.atleast_3d(pixels)
    kind = {"uint8": oiio.UINT8, "uint16": oiio.UINT16, "float32": oiio.FLOAT}[str(pixels.dtype)]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec["oiio:UnassociatedAlpha"] = 1  # or the writer divides the colours by alpha
    for key, value in attributes.items():
        spec[key] = value
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(np.ascontiguousarray(pixels)), file.geterror()
    file.close()
    return path


def test_a_png_comes_back_to_the_bit(tmp_path):
    image_files.write_png(tmp_path / "a.png", PICTURE / 255)
    assert np.array_equal(np.rint(image_files.read_photo(tmp_path / "a.png") * 255).astype(np.uint8), PICTURE)


def test_writing_the_same_image_twice_gives_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        image_files.write_png(tmp_path / name, PICTURE / 255)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_write_that_fails_leaves_nothing_behind(tmp_path):
    (tmp_path / ".a.png.part.png").symlink_to("/dev/full")
    with pytest.raises(OSError):
        image_files.write_png(tmp_path / "a.png", np.tile(PICTURE / 255, (99, 99, 1)))
    assert not list(tmp_path.iterdir())


def test_sixteen_bits_are_read_to_their_full_depth(tmp_path):
    path = stored(tmp_path / "a.tif", np.full((4, 5, 3), 12345, np.uint16))
    assert image_files.read_photo(path) == pytest.approx(12345 / 65535, abs=1e-7)


def test_grey_becomes_three_equal_channels(tmp_path):
    path = stored(tmp_path / "a.png", PICTURE[..., :1])
    assert image_files.read_photo(path) == pytest.approx(
        np.repeat(PICTURE[..., :1], 3, 2) / 255, abs=1e-7
    )  # float32's rounding


@pytest.mark.parametrize("channels", [2, 4])
def test_alpha_is_left_out_and_colours_stay_as_stored(tmp_path, channels):
    with_alpha = np.concatenate([PICTURE[..., : channels - 1], np.full((6, 9, 1), 100, np.uint8)], 2)
    seen = image_files.read_photo(stored(tmp_path / "a.png", with_alpha))
    assert np.rint(seen[..., 0] * 255).astype(int).tolist() == PICTURE[..., 0].tolist()


# What a 2 x 3 sensor picture 012 / 345 looks like upright, by the EXIF standard's table of orientations.
UPRIGHT = {
    1: [[0, 1, 2], [3, 4, 5]],
    2: [[2, 1, 0], [5, 4, 3]],
    3: [[5, 4, 3], [2, 1, 0]],
    4: [[3, 4, 5], [0, 1, 2]],
    5: [[0, 3], [1, 4], [2, 5]],
    6: [[3, 0], [4, 1], [5, 2]],
    7: [[5, 2], [4, 1], [3, 0]],
    8: [[2, 5], [1, 4], [0, 3]],
}


@pytest.mark.parametrize("orientation", UPRIGHT)
def test_exif_orientation_is_applied(tmp_path, orientation):
    sensor = np.repeat(np.arange(6, dtype=np.uint8).reshape(2, 3, 1), 3, 2)
    path = stored(tmp_path / "a.tif", sensor, Orientation=orientation)
    assert (image_files.read_photo(path)[..., 0] * 255).round().tolist() == UPRIGHT[orientation]
    width, height = image_files.read_size(path)
    assert (height, width) == np.shape(UPRIGHT[orientation])


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif", "webp", "bmp"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.6, 0.95])
def test_a_half_written_image_is_refused_by_name(tmp_path, suffix, share):
    path = stored(tmp_path / f"half.{suffix}", GENERATOR.integers(0, 256, (90, 80, 3)).astype(np.uint8))
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    with pytest.raises(InputError, match=f"half.{suffix}"):
        image_files.read_photo(path)


def test_what_is_no_image_and_what_is_not_there_is_refused_by_name(tmp_path):
    (tmp_path / "text.jpg").write_text("no image at all")
    for name in ("text.jpg", "nothing.jpg"):
        with pytest.raises(InputError, match=name):
            image_files.read_photo(tmp_path / name)


def test_a_header_that_promises_too_many_pixels_is_refused_before_they_are_allocated(tmp_path):
    path = tmp_path / "huge.png"
    chunk = b"IHDR" + struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    head = struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + head + struct.pack(">I", 9) + b"IDAT" + bytes(99))
    with pytest.raises(InputError, match="huge.png"):
        image_files.read_photo(path)


def test_more_pixels_than_allowed_are_refused_with_their_number(tmp_path, monkeypatch):
    image_files.write_png(tmp_path / "a.png", PICTURE / 255)
    monkeypatch.setattr(image_files, "MAX_PIXELS", 6 * 9 - 1)
    with pytest.raises(InputError, match="a.png: 9 x 6 pixels"):
        image_files.read_photo(tmp_path / "a.png")


def test_a_float_image_with_nan_is_refused(tmp_path):
    pixels = np.full((4, 4, 3), 0.5, np.float32)
    pixels[1, 2] = np.nan
    with pytest.raises(InputError, match="finite"):
        image_files.read_photo(stored(tmp_path / "a.tif", pixels))


def test_photos_are_listed_by_name_without_hidden_and_other_files(tmp_path):
    for name in ("b.JPG", "a.png", ".c.jpg", "notes.txt", "raw.dng"):
        (tmp_path / name).write_bytes(b"x")
    assert [p.name for p in image_files.list_photos(tmp_path)] == ["a.png", "b.JPG"]


def test_a_folder_without_photos_is_refused_and_says_what_to_do(tmp_path):
    (tmp_path / "raw.heic").write_bytes(b"x")
    with pytest.raises(InputError, match="no photos.*raw.heic.*JPEG"):
        image_files.list_photos(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        image_files.list_photos(tmp_path / "nowhere")


def test_shrinking_averages_areas_by_hand():
    row = np.array([[0.0, 3.0, 6.0]], np.float32)[..., None]
    # Two pixels of 1.5 old ones each: (0 + 3/2) / 1.5 = 1 and (3/2 + 6) / 1.5 = 5.
    assert image_files.shrink_image(row, 2, 1)[0, :, 0] == pytest.approx([1, 5])


def test_shrinking_equals_blocks_of_the_finest_common_grid():
    image = GENERATOR.random((6, 10, 3)).astype(np.float32)
    fine = image.repeat(2, 0).repeat(4 // 2, 1)  # 12 x 20: multiples of 4 x 5
    slow = fine.reshape(4, 3, 5, 4, 3).mean((1, 3))
    assert image_files.shrink_image(image, 5, 4) == pytest.approx(slow, abs=1e-6)  # one rounding to float32


def test_shrinking_keeps_the_mean_and_a_constant():
    image = GENERATOR.random((31, 47, 3)).astype(np.float32)
    assert image_files.shrink_image(image, 13, 7).mean((0, 1)) == pytest.approx(image.mean((0, 1)), abs=1e-6)
    assert np.array_equal(image_files.shrink_image(image, 47, 31), image)


def test_photos_are_never_enlarged():
    with pytest.raises(ValueError, match="does not shrink"):
        image_files.shrink_image(np.zeros((4, 4, 3), np.float32), 5, 4)


def test_exr_keeps_channels_by_name_and_texts_and_leaves_the_arguments_alone(tmp_path):
    maps = {k: GENERATOR.random((3, 5)).astype(np.float32) for k in ("R", "G", "B", "Z", "uncertainty")}
    channels, header = dict(maps), {"lam": repr(0.1), "pose": "a"}
    image_files.write_exr(tmp_path / "a.exr", channels, header)
    assert all(channels[k] is maps[k] for k in maps) and header == {"lam": "0.1", "pose": "a"}
    back, texts = image_files.read_exr(tmp_path / "a.exr")
    assert set(back) == set(maps) and all(np.array_equal(back[k], maps[k]) for k in maps)
    assert texts == header


def test_exr_parts_keep_their_own_sizes_and_headers(tmp_path):
    parts = {n: ({"u": GENERATOR.random(s).astype(np.float32)}, {"n": n}) for n, s in [("a", (2, 3)), ("b", (4, 1))]}
    image_files.write_exr_parts(tmp_path / "a.exr", parts)
    back = image_files.read_exr_parts(tmp_path / "a.exr")
    assert list(back) == ["a", "b"]
    for name, (channels, header) in back.items():
        assert np.array_equal(channels["u"], parts[name][0]["u"]) and header == parts[name][1]


def test_a_map_has_colours_for_viewers_that_are_no_channels_of_ours(tmp_path):
    """Read by OpenImageIO as a picture; the lowest value is dark, the highest bright, no number grey."""
    values = np.linspace(-3, 7, 60).reshape(6, 10).astype(np.float32)
    values[2, 3] = np.nan
    image_files.write_exr(tmp_path / "a.exr", {"Z": values, "seen": np.ones((6, 10), np.float32)}, {"n": "1"})
    channels, texts = image_files.read_exr(tmp_path / "a.exr")
    assert set(channels) == {"Z", "seen"} and texts == {"n": "1"}
    np.testing.assert_array_equal(channels["Z"], values)
    picture = image_files.read_photo(tmp_path / "a.exr")
    assert picture.shape == (6, 10, 3) and picture[0, 0].sum() < 0.5 < 1 < picture[-1, -1].sum()
    assert len(set(picture[2, 3].tolist())) == 1


def test_a_map_without_any_number_or_without_range_still_has_a_preview(tmp_path):
    for value in (np.nan, 4.0):
        image_files.write_exr(tmp_path / "a.exr", {"u": np.full((2, 2), value, np.float32)})
        assert set(image_files.read_exr(tmp_path / "a.exr")[0]) == {"u"}


def test_opencv_shows_the_preview(tmp_path, monkeypatch):
    monkeypatch.setenv("OPENCV_IO_ENABLE_OPENEXR", "1")
    cv2 = pytest.importorskip("cv2", reason="opencv is not installed")
    image_files.write_exr(tmp_path / "a.exr", {"Z": np.linspace(0, 1, 60).reshape(6, 10).astype(np.float32)})
    seen = cv2.imread(str(tmp_path / "a.exr"), cv2.IMREAD_UNCHANGED)
    if seen is None:
        pytest.skip("this OpenCV reads no EXR")
    assert seen.shape == (6, 10, 3) and seen[-1, -1].sum() > 1.5 > 0.5 > seen[0, 0].sum() >= 0


def test_a_damaged_exr_is_refused_by_name(tmp_path):
    image_files.write_exr(tmp_path / "a.exr", {"u": GENERATOR.random((64, 64))})
    (tmp_path / "a.exr").write_bytes((tmp_path / "a.exr").read_bytes()[:900])
    with pytest.raises(InputError, match="a.exr"):
        image_files.read_exr(tmp_path / "a.exr")


@pytest.mark.parametrize(
    "write", [image_files.write_png, lambda path, image: image_files.write_exr(path, {"a": image[..., 0]})]
)
def test_an_image_that_cannot_be_written_is_named_with_the_remedy(write, tmp_path):
    """By a limit of the size of files: the same fault as a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError, match=r"a\.\w+: not written .* free some space, then run the same again"):
            write(tmp_path / "a.png", np.random.default_rng(0).random((64, 64, 3)).astype(np.float32))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())
