"""Positions of photos by a geo.txt, as OpenDroneMap reads it (docs.opendronemap.org/geo)."""

import logging
import re
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError

from dav_gswt.errors import InputError

_log = logging.getLogger(__name__)

GEO_FILE, LARGEST_GEO = "geo.txt", 1 << 24  # bytes
UTM = re.compile(r"WGS ?84 UTM (?P<zone>[1-9]|[1-5]\d|60) ?(?P<half>[NS])", re.IGNORECASE)
# A PROJ string without words that name files.
PROJ = re.compile(
    r"\+proj=\w+( \+(zone|south|ellps|datum|units|no_defs|towgs84|type|k|k_0|lat_[012]|lat_ts|lon_0|x_0|y_0|a|b|rf)"
    r"(=[-\w.,]+)?)*"
)

Place = tuple[float, float, float]  # latitude, longitude in degrees, altitude in metres


def list_geo_files(paths: Iterable[Path]) -> dict[Path, list[Path]]:
    """The geo.txt beside photos, or beside their folder `images`, and the photos of each."""
    found = defaultdict(list)
    for path in paths:
        beside = [path.parent, path.parent.parent][: 1 + (path.parent.name.lower() == "images")]
        if file := next((folder / GEO_FILE for folder in beside if (folder / GEO_FILE).is_file()), None):
            found[file].append(path)
    return dict(sorted(found.items()))


def read_geo_files(paths: list[Path]) -> dict[Path, Place]:
    """The positions of photos by the geo.txt that belongs to them: latitude, longitude, altitude or NaN.

    Its first line names the coordinates (`EPSG:4326`, `WGS84 UTM 16N` or a PROJ string), each further line a photo, x
    or longitude, y or latitude, and perhaps the altitude; what follows is not read. Names are those of the files.
    Raises: InputError: too large, coordinates that are not known, or a line that is none; with the line.
    """
    places = {}
    for file, photos in list_geo_files(paths).items():
        listed = _read_geo_file(file)
        known = {path: listed[path.name] for path in photos if path.name in listed}
        _log.info("%s: positions of %d of %d photos", file, len(known), len(photos))
        places |= known
    return places


def _read_geo_file(file: Path) -> dict[str, Place]:
    if file.stat().st_size > LARGEST_GEO:
        raise InputError(f"{file}: larger than {LARGEST_GEO} bytes; is it the positions of photos?")
    first, *lines = file.read_text(encoding="utf-8-sig", errors="replace").splitlines() or [""]
    to_earth = Transformer.from_crs(_read_projection(file, " ".join(first.split())), "EPSG:4326", always_xy=True)
    places = {}
    for number, line in enumerate(lines, 2):
        if not (words := line.split()):
            continue
        try:
            x, y, z = (float(word) for word in (*words[1:4], "nan")[:3])
        except ValueError:
            raise InputError(f"{file}: line {number}: is not `photo.jpg x y altitude`; correct or remove it") from None
        longitude, latitude = to_earth.transform(x, y)
        if not (abs(latitude) <= 90 and abs(longitude) <= 360):
            raise InputError(f"{file}: line {number}: no place on earth by {first[:60]!r}; correct that first line")
        places[words[0]] = latitude, longitude, z
    return places


def _read_projection(file: Path, line: str) -> CRS:
    """The coordinates that the first line names."""
    try:
        if found := UTM.fullmatch(line):
            return CRS.from_epsg({"N": 32600, "S": 32700}[found["half"].upper()] + int(found["zone"]))
        if re.fullmatch(r"EPSG:\d{1,6}", line, re.IGNORECASE):
            return CRS.from_epsg(int(line[5:]))
        if PROJ.fullmatch(line):
            return CRS.from_proj4(line)
    except CRSError as error:
        _log.debug("%s: %s", file, error)
    raise InputError(
        f"{file}: line 1: {line[:60]!r} is no projection that is read; write EPSG:4326 (longitude, latitude), "
        "WGS84 UTM 16N or a PROJ string without grids"
    )
