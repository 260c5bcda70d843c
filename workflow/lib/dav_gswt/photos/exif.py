"""EXIF of a photo: focal length in pixels of the picture as it is, position, and time."""

import math
from datetime import datetime
from io import BytesIO
from pathlib import Path

import exifread
import OpenImageIO as oiio
from exifread.core.ifd_tag import IfdTag
from exifread.utils import Ratio

from dav_gswt.errors import InputError
from dav_gswt.images import image_files

FILM_DIAGONAL = 43.2666  # of a 36 x 24 mm frame, which "35 mm equivalent" compares diagonals with
WIDEST = 1.55  # photos wider than a 3:2 sensor are cut from a 4:3 one, whose diagonal the equivalent refers to
UNITS = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}  # FocalPlaneResolutionUnit in millimetres


def read_focal_length(path: Path | str) -> float | None:
    """Focal length in pixels of the stored picture, or None where EXIF does not say.

    From the focal length and the sensor's pixel pitch where both are there, else from the 35 mm equivalent
    (`convert_equivalent`). Where the tagged width differs from the real one, the pitch is scaled with it: the photo was
    resized, the tag not.
    """
    width, height = sorted(image_files.read_size(path), reverse=True)
    tags = _read_jpeg_tags(Path(path))
    spec = _open_header(path)
    focal = tags.get("EXIF FocalLength") or _number(spec.getattribute("Exif:FocalLength"))
    film = tags.get("EXIF FocalLengthIn35mmFilm") or _number(spec.getattribute("Exif:FocalLengthIn35mmFilm"))
    pitch, unit = tags.get("EXIF FocalPlaneXResolution"), UNITS.get(int(tags.get("EXIF FocalPlaneResolutionUnit", 2)))
    if focal > 0 and pitch and unit:
        # some programs exchange width and length
        tagged = max(tags.get(f"EXIF ExifImage{side}", 0) for side in ("Width", "Length"))
        pixels = focal / unit * pitch * width / (tagged if tagged >= 1 else width)
    elif film > 0:
        pixels = convert_equivalent(film, width, height)
    else:
        return None
    # Beyond these the tag is a default or garbage: from a fisheye's 150 degrees to a long telescope.
    return pixels if 0.13 * width < pixels < 100 * width else None


def convert_equivalent(film: float, width: int, height: int) -> float:
    """Focal length in pixels of a picture of this size from its 35 mm equivalent, by the diagonal.

    film / 43.27 mm * sqrt(w^2 + h^2), w the longer side; with the height of the 4:3 sensor where the picture is wider
    than 3:2.
    """
    longer, shorter = max(width, height), min(width, height)
    across = max(shorter, 0.75 * longer) if longer > WIDEST * shorter else shorter
    return film / FILM_DIAGONAL * (longer**2 + across**2) ** 0.5


def read_gps_position(path: Path | str) -> tuple[float, float, float] | None:
    """Latitude and longitude in degrees and altitude in metres, or None where EXIF does not have all three."""
    spec = _open_header(path)
    angles = []
    for name, negative, most in (("Latitude", "S", 90.0), ("Longitude", "W", 180.0)):
        parts = spec.getattribute(f"GPS:{name}")
        if not isinstance(parts, tuple) or len(parts) != 3 or not all(isinstance(p, int | float) for p in parts):
            return None
        angle = float(parts[0] + parts[1] / 60 + parts[2] / 3600)
        if not 0 <= angle <= most:
            return None
        angles.append(-angle if spec.getattribute(f"GPS:{name}Ref") == negative else angle)
    altitude = spec.getattribute("GPS:Altitude")
    if not isinstance(altitude, int | float) or not abs(altitude) < 1e5 or angles == [0.0, 0.0]:
        return None
    return angles[0], angles[1], -float(altitude) if spec.getattribute("GPS:AltitudeRef") == 1 else float(altitude)


def read_capture_time(path: Path | str) -> str | None:
    """When the photo was taken, ISO 8601 without a time zone, or None where EXIF does not say."""
    text = _open_header(path).getattribute("Exif:DateTimeOriginal")
    try:
        return datetime.strptime(str(text), "%Y:%m:%d %H:%M:%S").isoformat()
    except ValueError:
        return None


def _open_header(path: Path | str) -> oiio.ImageSpec:
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise InputError(f"{path}: not readable as an image; remove or replace it")
    return file.spec()


def _number(value) -> float:
    return float(value) if isinstance(value, int | float) and value == value else 0.0


def _read_jpeg_tags(path: Path) -> dict[str, float]:
    """Finite numbers of a JPEG's EXIF block by tag. OpenImageIO drops the pixel pitch where it is no rational.

    Only the start of the file is read, which holds the block.
    """
    with path.open("rb") as file:
        head = file.read(1 << 17)
    if head[:2] != b"\xff\xd8" or b"Exif\0\0" not in head:
        return {}
    try:
        tags = exifread.process_file(BytesIO(head), details=False, extract_thumbnail=False)
    except Exception:  # whatever a damaged block leads the parser to
        return {}
    numbers = {name: _first_number(tag.values) for name, tag in tags.items() if isinstance(tag, IfdTag)}
    return {name: value for name, value in numbers.items() if value is not None and math.isfinite(value)}


def _first_number(values) -> float | None:
    value = values[0] if isinstance(values, list) and values else None
    if isinstance(value, tuple):  # as the parser gives floats
        value = value[0] if value else None
    if isinstance(value, Ratio):
        return value.num / (value.den or 1)
    return float(value) if isinstance(value, int | float) else None
