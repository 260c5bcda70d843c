"""Photos as phones and cameras store them: HEIC, HEIF and AVIF by Pillow and pillow-heif, raw ones by LibRaw (rawpy).

All are returned upright: what the file says of its orientation is applied, once.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE
from dav_gswt.images.file_kinds import Kind

SRGB = (2.4, 12.92)  # exponent, and slope near black, of the curve of colours
QUARTER_TURNS = {5, 6}  # LibRaw's numbers of orientations that exchange width and height


@dataclass(frozen=True)
class Decoder:
    """How photos of a kind are read: their width and height without decoding them, and their pixels, in [0, 1]."""

    read_size: Callable[[Path], tuple[int, int]]
    read_pixels: Callable[[Path], Float32[Array, "h w c"]]


@contextmanager
def _open_heif(path: Path) -> Iterator[Any]:
    """An open image. Raises: InputError: it cannot be read."""
    import pillow_heif  # here, not above: most jobs read no such photo
    from PIL import Image

    pillow_heif.register_heif_opener(decode_threads=1)
    try:
        with Image.open(path) as image:
            yield image
    except UNREADABLE as error:
        raise _refuse(path, error) from error


def _read_heif_size(path: Path) -> tuple[int, int]:
    from PIL import ExifTags

    with _open_heif(path) as image:
        turned = image.getexif().get(ExifTags.Base.Orientation, 1) >= 5  # AVIF's; HEIC is upright already
        width, height = image.size
        return (height, width) if turned else (width, height)


def _read_heif(path: Path) -> Float32[Array, "h w c"]:
    from PIL import ImageOps

    with _open_heif(path) as image:
        upright = ImageOps.exif_transpose(image)
        pixels = np.asarray(upright.convert("RGBA" if upright.has_transparency_data else "RGB"))
    return pixels.astype(np.float32) / 255


def read_heif_exif(path: Path) -> bytes:
    """The EXIF of a HEIC, HEIF or AVIF as a TIFF; empty where there is none."""
    with _open_heif(path) as image:
        return image.info.get("exif", b"").removeprefix(b"Exif\0\0")


@contextmanager
def _open_raw(path: Path):
    """An open raw photo. Raises: InputError: as `_open_heif`."""
    try:
        import rawpy  # pyright: ignore[reportMissingImports]  an extra
    except ImportError as error:
        raise InputError(
            f"{path}: raw photos are read with an extra: pip install 'dav-gswt[raw]' (in a clone: .venv/bin/pip "
            "install -e '.[raw]'), or convert them to JPEG"
        ) from error
    try:
        with rawpy.imread(str(path)) as raw:
            yield raw
    except Exception as error:  # LibRaw's errors have no common class but this
        raise _refuse(path, error) from error


def _read_raw_size(path: Path) -> tuple[int, int]:
    with _open_raw(path) as raw:
        size = raw.sizes
        return (size.height, size.width) if size.flip in QUARTER_TURNS else (size.width, size.height)


def _read_raw(path: Path) -> Float32[Array, "h w c"]:
    """Developed alike, so that photos of a set agree: the camera's white balance, no brightening by the picture."""
    with _open_raw(path) as raw:
        pixels = raw.postprocess(use_camera_wb=True, no_auto_bright=True, output_bps=16, gamma=SRGB)
    return pixels.astype(np.float32) / 65535


def _refuse(path: Path, error: Exception) -> InputError:
    return InputError(f"{path}: not readable as an image ({summarize_error(error)}); remove or replace it")


DECODERS: dict[Kind, Decoder] = {
    "heif": Decoder(_read_heif_size, _read_heif),
    "raw": Decoder(_read_raw_size, _read_raw),
}
