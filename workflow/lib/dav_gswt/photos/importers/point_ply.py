"""Point clouds from PLY files."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from plyfile import PlyData, PlyParseError

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE
from dav_gswt.photos.importers import checks
from dav_gswt.photos.importers.checks import check_finite, check_size


def read_point_ply(path: Path) -> tuple[Float[Array, "n 3"], Float32[Array, "n 3"]]:
    """Positions, and colours as sRGB in [0, 1]: mid-grey where the file has none.

    Raises: InputError: not a PLY of points, promises more than it holds, or a number is not finite.
    """
    size = check_size(path, checks.LARGEST)
    try:
        with path.open("rb") as file:
            header = PlyData._parse_header(file)
            room = size - file.tell()
        promised = sum(e.count * max(1, len(e.properties)) for e in header.elements)
        if promised > room or max((e.count for e in header.elements), default=0) > checks.MOST_POINTS:
            raise InputError(f"{path}: promises more points than it holds, or than are read; is it cut short?")
        rows = PlyData.read(str(path))["vertex"].data
        places = np.stack([np.asarray(rows[axis], float) for axis in "xyz"], -1)
        colours = np.full(places.shape, 0.5, np.float32)
        if {"red", "green", "blue"} <= set(rows.dtype.names):
            whole = rows.dtype["red"].kind in "ui"
            stack = np.stack([np.asarray(rows[c], np.float32) for c in ("red", "green", "blue")], -1)
            colours = np.clip(stack / (np.iinfo(rows.dtype["red"]).max if whole else 1), 0, 1)
    except (PlyParseError, *UNREADABLE) as error:
        why = summarize_error(error)
        raise InputError(f"{path}: not readable as a PLY of points ({why}); export or copy it again") from error
    return check_finite(places, str(path)), check_finite(colours.astype(np.float32), str(path))
