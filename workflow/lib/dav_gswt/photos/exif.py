"""What a photo's EXIF claims: focal length in pixels of the picture as it is, position, and time."""

import struct
from datetime import datetime
from pathlib import Path

import OpenImageIO as oiio

from dav_gswt.images import image_files

FILM_DIAGONAL = 43.2666  # of a 36 x 24 mm frame, which "35 mm equivalent" compares diagonals with
WIDEST = 1.55  # photos wider than a 3:2 sensor are cut from a 4:3 one, whose diagonal the equivalent refers to
UNITS = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}  # FocalPlaneResolutionUnit in millimetres
_FORMATS = {3: "H", 4: "I", 5: "II", 9: "i", 10: "ii", 11: "f", 12: "d"}  # TIFF's types of numbers
_EXIF_IFD, _FOCAL, _PLANE_X, _PLANE_UNIT, _FILM, _WIDTH = 0x8769, 0x920A, 0xA20E, 0xA210, 0xA405, 0xA002


def read_focal_length(path: Path | str) -> float | None:
    """Focal length in pixels of the stored picture, or None where EXIF does not say.

    From the focal length and the sensor's pixel pitch where both are there, else from the 35 mm equivalent f by the
    diagonal: f / 43.27 mm * sqrt(w^2 + h^2), with the height of the 4:3 sensor where the picture is wider than 3:2.
    Where the tagged width differs from the real one, the pitch is scaled with it: the photo was resized, the tag not.
    """
    width, height = sorted(image_files.read_size(path), reverse=True)
    tags = _jpeg_tags(Path(path))
    spec = oiio.ImageInput.open(str(path)).spec()
    focal = tags.get(_FOCAL) or _number(spec.getattribute("Exif:FocalLength"))
    film = tags.get(_FILM) or _number(spec.getattribute("Exif:FocalLengthIn35mmFilm"))
    pitch, unit = tags.get(_PLANE_X), UNITS.get(int(tags.get(_PLANE_UNIT, 2)))
    if focal > 0 and pitch and unit:
        pixels = focal / unit * pitch * width / max(tags.get(_WIDTH, width), 1)
    elif film > 0:
        pixels = (
            film
            / FILM_DIAGONAL
            * (width**2 + (max(height, 0.75 * width) if width > WIDEST * height else height) ** 2) ** 0.5
        )
    else:
        return None
    # Beyond these the tag is a default or garbage: from a fisheye's 150 degrees to a long telescope.
    return pixels if 0.13 * width < pixels < 100 * width else None


def read_gps_position(path: Path | str) -> tuple[float, float, float] | None:
    """Latitude and longitude in degrees and altitude in metres, or None where EXIF does not have all three."""
    spec = oiio.ImageInput.open(str(path)).spec()
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
    text = oiio.ImageInput.open(str(path)).spec().getattribute("Exif:DateTimeOriginal")
    try:
        return datetime.strptime(str(text), "%Y:%m:%d %H:%M:%S").isoformat()
    except ValueError:
        return None


def _number(value) -> float:
    return float(value) if isinstance(value, int | float) and value == value else 0.0


def _jpeg_tags(path: Path) -> dict[int, float]:
    """Numbers of the EXIF block by tag. OpenImageIO drops the pixel pitch where it is not stored as a rational."""
    with path.open("rb") as file:
        head = file.read(1 << 17)
    start = head.find(b"Exif\0\0")
    if head[:2] != b"\xff\xd8" or start < 0:
        return {}
    block = head[start + 6 :]
    order = "<" if block[:2] == b"II" else ">"
    try:
        first = _directory(block, order, struct.unpack_from(order + "I", block, 4)[0])
        return _directory(block, order, int(first[_EXIF_IFD]))
    except (struct.error, KeyError):
        return {}


def _directory(block: bytes, order: str, offset: int) -> dict[int, float]:
    """One TIFF directory: the first value of every entry that is a number."""
    values = {}
    for k in range(struct.unpack_from(order + "H", block, offset)[0]):
        at = offset + 2 + 12 * k
        tag, kind, _ = struct.unpack_from(order + "HHI", block, at)
        if kind not in _FORMATS:
            continue
        form = order + _FORMATS[kind]
        place = at + 8 if struct.calcsize(form) <= 4 else struct.unpack_from(order + "I", block, at + 8)[0]
        number = struct.unpack_from(form, block, place)
        values[tag] = number[0] / (number[1] or 1) if len(number) == 2 else float(number[0])
    return values
