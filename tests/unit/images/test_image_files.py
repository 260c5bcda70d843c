"""Reading, writing and shrinking images, and float maps in EXR."""

import resource

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
    for name in ("a.png", "b.png"):
        image_files.write_png(tmp_path / name, PICTURE / 255)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert np.array_equal(np.rint(image_files.read_photo(tmp_path / "a.png") * 255).astype(np.uint8), PICTURE)


def test_sixteen_bits_are_read_to_their_full_depth_and_grey_becomes_three_equal_channels(tmp_path):
    path = stored(tmp_path / "a.tif", np.arange(20, dtype=np.uint16).reshape(4, 5, 1) * 3000)
    grey = np.repeat(np.arange(20).reshape(4, 5, 1) * 3000 / 65535, 3, 2)
    assert image_files.read_photo(path) == pytest.approx(grey, abs=1e-7)  # float32's rounding


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


def test_exif_orientation_is_applied(tmp_path):
    sensor = np.repeat(np.arange(6, dtype=np.uint8).reshape(2, 3, 1), 3, 2)
    for orientation, upright in UPRIGHT.items():
        path = stored(tmp_path / "a.tif", sensor, Orientation=orientation)
        assert (image_files.read_photo(path)[..., 0] * 255).round().tolist() == upright
        assert image_files.read_size(path)[::-1] == np.shape(upright)


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif", "webp"])
def test_a_half_written_image_is_refused_by_name(tmp_path, suffix):
    path = stored(tmp_path / f"half.{suffix}", GENERATOR.integers(0, 256, (90, 80, 3)).astype(np.uint8))
    whole = path.read_bytes()
    for share in (0.95, 0.1, 0.0):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(InputError, match=f"half.{suffix}"):
            image_files.read_photo(path)
    path.unlink()
    with pytest.raises(InputError, match="there is no such file"):
        image_files.read_photo(path)


def test_more_pixels_than_allowed_are_refused_with_their_number(tmp_path, monkeypatch):
    image_files.write_png(tmp_path / "a.png", PICTURE / 255)
    monkeypatch.setattr(image_files, "MAX_PIXELS", 6 * 9 - 1)
    with pytest.raises(InputError, match="a.png: 9 x 6 pixels"):
        image_files.read_photo(tmp_path / "a.png")


def test_a_float_image_with_nan_is_refused(tmp_path):
    with pytest.raises(InputError, match="finite"):
        image_files.read_photo(stored(tmp_path / "a.tif", np.full((4, 4, 3), np.nan, np.float32)))


def test_shrinking_averages_areas():
    row = np.array([[0.0, 3.0, 6.0]], np.float32)[..., None]
    # two pixels of 1.5 old ones each: (0 + 3/2) / 1.5 = 1 and (3/2 + 6) / 1.5 = 5
    assert image_files.shrink_image(row, 2, 1)[0, :, 0] == pytest.approx([1, 5])
    image = GENERATOR.random((6, 10, 3)).astype(np.float32)
    fine = image.repeat(2, 0).repeat(2, 1)  # 12 x 20: multiples of 4 x 5
    slow = fine.reshape(4, 3, 5, 4, 3).mean((1, 3))
    assert image_files.shrink_image(image, 5, 4) == pytest.approx(slow, abs=1e-6)  # one rounding to float32
    assert image_files.shrink_to(image, 5).shape == (3, 5, 3)


@pytest.mark.parametrize("turn", [1, 6])
def test_a_large_jpeg_is_shrunk_as_it_is_decoded(turn, tmp_path):
    """Means over 3 x 3 pixels of a picture without detail finer than 16: the same to two steps of 8 bits."""
    y, x = np.mgrid[:240, :360] / 16
    picture = np.repeat(0.5 + 0.2 * (np.sin(x) + np.cos(y))[..., None], 3, axis=2)  # JPEG halves the colours anyway
    path = stored(tmp_path / "a.jpg", np.uint8(255 * picture), Orientation=turn)
    small = image_files.read_shrunk_photo(path, 120)
    assert small.shape == ((80, 120, 3) if turn == 1 else (120, 80, 3))
    assert np.abs(small - image_files.shrink_to(image_files.read_photo(path), 120)).max() < 2.5 / 255


def test_a_jpeg_that_was_cut_short_is_refused_by_name_at_any_size(tmp_path):
    path = stored(tmp_path / "a.jpg", GENERATOR.integers(0, 256, (160, 160, 3)).astype(np.uint8))
    path.write_bytes(path.read_bytes()[:3000])
    for longest in (20, 160):
        with pytest.raises(InputError, match=r"a\.jpg: damaged or cut short") as refused:
            image_files.read_shrunk_photo(path, longest)
        assert str(refused.value).count(str(path)) == 1


def test_exr_keeps_parts_channels_and_texts_by_name_and_leaves_the_arguments_alone(tmp_path):
    maps = {k: GENERATOR.random((3, 5)).astype(np.float32) for k in ("R", "G", "B", "Z", "uncertainty")}
    channels, header = dict(maps), {"lam": repr(0.1), "pose": "a"}
    image_files.write_exr(tmp_path / "a.exr", channels, header)
    assert all(channels[k] is maps[k] for k in maps) and header == {"lam": "0.1", "pose": "a"}
    back, texts = image_files.read_exr(tmp_path / "a.exr")
    assert set(back) == set(maps) and all(np.array_equal(back[k], maps[k]) for k in maps)
    assert texts == header
    parts = {n: ({"u": GENERATOR.random(s).astype(np.float32)}, {"n": n}) for n, s in [("a", (2, 3)), ("b", (4, 1))]}
    image_files.write_exr_parts(tmp_path / "a.exr", parts)
    for name, (channels, header) in image_files.read_exr_parts(tmp_path / "a.exr").items():
        assert np.array_equal(channels["u"], parts[name][0]["u"]) and header == parts.pop(name)[1]
    assert not parts


def test_a_damaged_exr_is_refused_by_name(tmp_path, monkeypatch):
    image_files.write_exr(tmp_path / "a.exr", {"u": GENERATOR.random((64, 64))})
    with monkeypatch.context() as patch, pytest.raises(InputError, match="64 x 64 pixels is more than is read"):
        patch.setattr(image_files, "MAX_PIXELS", 64 * 64 - 1)
        image_files.read_exr(tmp_path / "a.exr")
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
