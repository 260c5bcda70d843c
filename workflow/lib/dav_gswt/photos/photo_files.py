"""The files of photos: what EXIF says (focal length, place, time, sun), and names of the pictures made of them."""

import logging
import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import get_args

import exifread
import numpy as np
from exifread.utils import Ratio
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.geometry.sun import LOWEST, CapturedSun, Clock, locate_sun
from dav_gswt.images import image_files
from dav_gswt.images.camera_formats import read_heif_exif
from dav_gswt.images.file_kinds import HEIF_SUFFIXES, RAW_SUFFIXES, SUFFIXES, detect_kind
from dav_gswt.logs import progress
from dav_gswt.threads import map_ahead

logging.getLogger("exifread").setLevel(logging.ERROR)  # it warns of every picture without EXIF

FILM_DIAGONAL = 43.2666  # mm, of a 36 x 24 mm frame: "35 mm equivalent" compares diagonals
WIDEST = 1.55  # photos wider than a 3:2 sensor are cropped from a 4:3 sensor, whose diagonal the equivalent refers to
UNITS = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}  # FocalPlaneResolutionUnit in millimetres
EXIF_TIME = "%Y:%m:%d %H:%M:%S"
YEARS = range(1990, 2101)  # in which photos are taken: cameras whose clock was never set report 1970 or 1980
UNSAFE = re.compile(
    r"[\s#{}<>]+"
)  # COLMAP's lists end a name at a blank and skip lines with #; Snakemake has {} and <>
_log = logging.getLogger(__name__)
SIDE = 2000  # pixels along the longer side at which photos are compared
FAR = 8  # pixels
BLUR = 0.6  # a picture with less than this share of the usual fine detail is blurred
USUAL = 80  # percentile of all pictures that is usual
GREY = np.array([0.299, 0.587, 0.114], np.float32)  # Rec. 601


def read_focal_length(path: Path | str) -> float | None:
    """Focal length in pixels of the stored picture, or None where EXIF does not say.

    The pixel pitch of the sensor is used if EXIF has it, else the 35 mm equivalent
    (`convert_equivalent`). If the tagged width differs from the real width, the photo was resized
    and the pitch is scaled.
    """
    width, height = sorted(image_files.read_size(path), reverse=True)
    tags = _read_tags(path)
    focal, film, pitch, unit, *tagged = (
        (_read_numbers(tags, f"EXIF {name}") or [default])[0]
        for name, default in (
            ("FocalLength", 0.0),
            ("FocalLengthIn35mmFilm", 0.0),
            ("FocalPlaneXResolution", 0.0),
            ("FocalPlaneResolutionUnit", 2),
            ("ExifImageWidth", 0.0),
            ("ExifImageLength", 0.0),
        )
    )
    if focal > 0 and pitch and int(unit) in UNITS:
        longer = max(tagged)  # some programs exchange width and length
        pixels = focal / UNITS[int(unit)] * pitch * width / (longer if longer >= 1 else width)
    elif film > 0:
        pixels = convert_equivalent(film, width, height)
    else:
        return None
    # Beyond these limits, a fisheye of 150 degrees and a long telescope, the tag is a default or garbage.
    return pixels if 0.13 * width < pixels < 100 * width else None


def convert_equivalent(film: float, width: int, height: int) -> float:
    """Focal length in pixels of a picture of this size from its 35 mm equivalent.

    The equivalent compares diagonals: f = film / 43.27 mm * sqrt(w^2 + h^2). Pictures wider than
    3:2 are cropped, so the height of the 4:3 sensor is used for them.
    """
    longer, shorter = max(width, height), min(width, height)
    across = max(shorter, 0.75 * longer) if longer > WIDEST * shorter else shorter
    return film / FILM_DIAGONAL * (longer**2 + across**2) ** 0.5


def read_gps_position(path: Path | str) -> tuple[float, float, float] | None:
    """Latitude and longitude in degrees and altitude in metres, NaN where EXIF has none; None without a place."""
    tags = _read_tags(path)

    def read(name: str) -> list[float]:
        return np.array(_read_numbers(tags, f"GPS GPS{name}"), np.float32).tolist()  # that is enough: 0.1 mm

    angles = []
    for name, negative, most in (("Latitude", "S", 90.0), ("Longitude", "W", 180.0)):
        parts = read(name)
        if len(parts) != 3 or not 0 <= (angle := parts[0] + parts[1] / 60 + parts[2] / 3600) <= most:
            return None
        angles.append(-angle if str(tags.get(f"GPS GPS{name}Ref")).startswith(negative) else angle)
    if angles == [0.0, 0.0]:
        return None
    altitude = read("Altitude")
    if not altitude or not abs(altitude[0]) < 1e5:
        return angles[0], angles[1], math.nan
    below = read("AltitudeRef") in ([1.0], [3.0])  # 3 since EXIF 3.0: below the sea, no longer the ellipsoid
    return angles[0], angles[1], -altitude[0] if below else altitude[0]


def read_capture_time(path: Path | str) -> str | None:
    """When the photo was taken, ISO 8601 without a time zone, or None where EXIF does not say."""
    local = _read_time(_read_tags(path), "EXIF DateTimeOriginal", EXIF_TIME)
    return local.isoformat() if local else None


@dataclass(frozen=True)
class PhotoTime:
    """When a photo was taken, UTC, and how that is known: see `geometry.sun.CapturedSun`."""

    utc: datetime
    clock: Clock
    zone: float


def read_utc_time(path: Path | str, longitude: float) -> PhotoTime | None:
    """When the photo was taken; None if EXIF does not say.

    GPS time is UTC. Otherwise EXIF has local time. If it names no zone, the zone follows from the longitude, without
    daylight saving. Years outside YEARS are clocks that were never set, or damaged.
    """
    tags = _read_tags(path)
    date, clock = _read_time(tags, "GPS GPSDate", "%Y:%m:%d"), _read_numbers(tags, "GPS GPSTimeStamp")
    local, zone = _read_time(tags, "EXIF DateTimeOriginal", EXIF_TIME), 0.0
    if date and date.year in YEARS and len(clock) == 3 and 0 <= (seconds := np.dot(clock, [3600, 60, 1])) < 86400:
        utc, known = date + timedelta(seconds=float(seconds)), "gps"
    elif local is None or local.year not in YEARS:
        return None
    else:
        offset = _read_time(tags, "EXIF OffsetTimeOriginal", "%z")
        east = offset.utcoffset() if offset else None
        zone = float(round(longitude / 15)) if east is None else east / timedelta(hours=1)
        utc, known = local - timedelta(hours=zone), "assumed" if east is None else "offset"
    return PhotoTime(utc.replace(tzinfo=UTC), known, zone)


def _read_time(tags: dict, name: str, form: str) -> datetime | None:
    """A tag with a date or time of this form; None without one."""
    try:
        return datetime.strptime(str(tags.get(name)), form)
    except ValueError:
        return None


def _read_tags(path: Path | str) -> dict:
    """The tags of a photo's EXIF; empty where there is none."""
    try:
        heif = detect_kind(Path(path)) == "heif"  # the parser finds EXIF in some of them only
        with BytesIO(read_heif_exif(Path(path))) if heif else Path(path).open("rb") as file:
            return exifread.process_file(file, details=False, extract_thumbnail=False)
    except OSError:
        raise
    except Exception:  # a damaged block may lead the parser to anything
        return {}


def _read_numbers(tags: dict, name: str) -> list[float]:
    """The numbers of a tag; none if one of them is not finite."""
    values = getattr(tags.get(name), "values", [])
    numbers = []
    for value in values if isinstance(values, list) else []:
        value = value[0] if isinstance(value, tuple) and value else value  # as the parser gives floats
        if isinstance(value, Ratio):
            value = value.num / (value.den or 1)
        if not isinstance(value, int | float) or not math.isfinite(value):
            return []
        numbers.append(float(value))
    return numbers


def split_stem(name: str) -> str:
    """The file name without its suffix. Only suffixes of pictures count, as names may have other dots."""
    path = PurePosixPath(name)
    return path.stem if path.suffix.lower() in SUFFIXES | HEIF_SUFFIXES | RAW_SUFFIXES and path.stem else path.name


def name_pictures(names: Sequence[str]) -> list[str]:
    """The PNG that is made of each photo: its stem, or its whole path if stems are equal, and a
    number if need be.

    Blanks, #, braces and < > become _, so that a name is one word in every list of images.
    """
    safe = [UNSAFE.sub("_", name) for name in names]
    stems = Counter(split_stem(name) for name in safe)
    out, used = [], set()
    for name in safe:
        stem = split_stem(name)
        plain = stem if stems[stem] == 1 else name.replace("/", "_").replace(".", "_")
        number, free = 1, plain
        while free in used:
            number, free = number + 1, f"{plain}_{number + 1}"
        used.add(free)
        out.append(f"{free}.png")
    return out


def find_sun(paths: Iterable[Path], place: Georeference) -> CapturedSun | None:
    """Find the sun at the median time of the photos. If it is not known, return None and log the reason.

    If the photos know their times in different ways (`Clock`), only the most frequent way is used, and among equally
    frequent ones the most reliable.
    """
    times = [time for path in paths if (time := read_utc_time(path, place.longitude))]
    if not times:
        _log.info("light: no photo says when it was taken: the sun is not known")
        return None
    counts = Counter(time.clock for time in times)
    clock: Clock = max(get_args(Clock), key=lambda each: counts[each])
    times = sorted((time for time in times if time.clock == clock), key=lambda time: time.utc)
    middle = times[len(times) // 2]
    hours = (times[-1].utc - times[0].utc).total_seconds() / 3600
    elevation, azimuth = locate_sun(middle.utc, place.latitude, place.longitude)
    stamp = f"{middle.utc:%Y-%m-%dT%H:%M:%SZ}"
    if elevation < LOWEST:
        _log.warning("light: at %s the sun stood %.0f degrees high: it is not known where it stood", stamp, elevation)
        return None
    sun = CapturedSun(round(elevation, 2), round(azimuth, 2) % 360, stamp, clock, middle.zone, round(hours, 2))
    _log.info("light: %s", sun.describe())
    return sun


def find_blurred(paths: Sequence[Path], threads: int) -> Bool[Array, "n"]:
    """Which of the photos are blurred, by their detail at SIDE pixels. threads: change no result."""
    grey = partial(image_files.read_shrunk_photo, longest=SIDE)
    detail = [*map_ahead(lambda path: measure_detail(grey(path) @ GREY), progress(paths, "look for blur"), threads)]
    return np.array(detail) < find_threshold(np.array(detail))


def measure_detail(grey: Float32[Array, "h w"]) -> float:
    """The least share, over four directions, of the contrast between neighbouring pixels in that of pixels FAR apart.

    Motion blurs along one direction, and a lens out of focus along all; the ratio hardly depends on what is shown.
    """
    shares = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        near, far = (_contrast(grey, dy * step, dx * step) for step in (1, FAR))
        shares.append(near / far if far > 0 else 0.0)
    return min(shares)


def find_threshold(detail: Float[Array, "n"], blur: float = BLUR) -> float:
    """The detail below which a picture of a set is blurred. blur: that share of the usual detail."""
    return blur * float(np.percentile(detail, USUAL))


def _contrast(grey: Float32[Array, "h w"], dy: int, dx: int) -> float:
    h, w = grey.shape
    first = grey[: h - dy, max(0, -dx) : w - max(0, dx)]
    second = grey[dy:, max(0, dx) : w + min(0, dx)]
    return float(np.abs(second - first).mean())
