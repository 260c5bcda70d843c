"""Photos as phones and cameras store them: upright once, with their EXIF, and refused by name where damaged."""

import sys
from types import SimpleNamespace

import numpy as np
import pillow_heif
import pytest
from PIL import Image

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos import photo_files

pillow_heif.register_heif_opener()


@pytest.fixture
def stored():
    """A picture as a sensor stores it, red at its left and bright at its top, and the EXIF of a phone held upright."""
    pixels = np.zeros((60, 80, 3), np.uint8)
    pixels[:30], pixels[:, :20] = 200, (255, 0, 0)
    exif = Image.Exif()
    exif[0x0112] = 6  # turn it clockwise
    exif.get_ifd(0x8769).update({0xA405: 26, 0x9003: "2024:05:06 07:08:09"})
    exif.get_ifd(0x8825).update({1: "N", 2: (48.0, 30.0, 0.0), 3: "W", 4: (9.0, 0.0, 0.0), 5: b"\0", 6: 300.0})
    return Image.fromarray(pixels), exif.tobytes()


@pytest.mark.parametrize(("kind", "name"), [("HEIF", "a.heic"), ("HEIF", "named.jpg"), ("AVIF", "a.avif")])
def test_heic_is_upright_once_and_has_its_exif_whatever_its_name(stored, tmp_path, kind, name):
    image, exif = stored
    image.save(tmp_path / name, format=kind, exif=exif, quality=95)
    image.save(tmp_path / "plain.jpg", exif=exif, quality=95)
    one, other = image_files.read_photo(tmp_path / name), image_files.read_photo(tmp_path / "plain.jpg")
    assert one.shape == (80, 60, 3) and image_files.read_size(tmp_path / name) == (60, 80)
    assert one[5, 30] == pytest.approx([1, 0, 0], abs=0.03) and one[-5, -5] == pytest.approx([0.78] * 3, abs=0.03)
    assert np.abs(one - other).mean() < 0.02
    for read in (photo_files.read_focal_length, photo_files.read_gps_position, photo_files.read_capture_time):
        assert read(tmp_path / name) == read(tmp_path / "plain.jpg") is not None


def test_heic_cut_short_is_refused_by_name_and_its_alpha_is_read(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 255, (300, 400, 4), np.uint8)
    pixels[..., 3], pixels[:, :200, 3] = 255, 0
    Image.fromarray(pixels).save(tmp_path / "a.heic", quality=90)
    alpha = image_files.read_photo_and_alpha(tmp_path / "a.heic")[1]
    assert alpha[:, :190].max() < 0.1 and alpha[:, 210:].min() > 0.9
    (tmp_path / "cut.heic").write_bytes((tmp_path / "a.heic").read_bytes()[:20_000])
    with pytest.raises(InputError, match="cut.heic: not readable as an image"):
        image_files.read_photo(tmp_path / "cut.heic")
    assert photo_files.read_capture_time(tmp_path / "cut.heic") is None


def test_a_raw_photo_names_the_extra_that_reads_it(tmp_path, monkeypatch):
    (tmp_path / "a.dng").write_bytes(b"II*\0")
    monkeypatch.setitem(sys.modules, "rawpy", None)
    with pytest.raises(InputError, match=r"a.dng: .*dav-gswt\[raw\]"):
        image_files.read_size(tmp_path / "a.dng")


def test_a_raw_photo_is_developed_upright_and_alike(tmp_path, monkeypatch):
    class Raw:
        sizes = SimpleNamespace(width=80, height=60, flip=6)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def postprocess(self, no_auto_bright, output_bps, **_):
            assert no_auto_bright and output_bps == 16
            return np.full((80, 60, 3), 13107, np.uint16)

    fake = SimpleNamespace(imread=lambda path: Raw(), LibRawError=RuntimeError)
    monkeypatch.setitem(sys.modules, "rawpy", fake)
    (tmp_path / "a.dng").write_bytes(b"II*\0")
    assert image_files.read_size(tmp_path / "a.dng") == (60, 80)
    assert image_files.read_photo(tmp_path / "a.dng") == pytest.approx(np.full((80, 60, 3), 0.2))
