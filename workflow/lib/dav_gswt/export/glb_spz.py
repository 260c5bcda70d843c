"""Gaussians in a GLB that holds an SPZ: KHR_gaussian_splatting_compression_spz_2, the form that CesiumJS draws.

Source: https://github.com/CesiumGS/glTF/tree/draft-splat-spz/extensions/2.0/Khronos (a draft). Attributes are named, so
that a program knows how many Gaussians there are, but have no values of their own: the SPZ has them, in version 2.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.export.axes import Y_UP
from dav_gswt.export.glb_splats import EXTENSION, begin_glb, find_bounds
from dav_gswt.export.spool import Spool
from dav_gswt.export.spz import write_spz

COMPRESSION = "KHR_gaussian_splatting_compression_spz_2"
SPZ_VERSION = 2  # of the extension


def write_glb_spz(spool: Spool, path: Path | str, extras: dict[str, Any], rotation: Float[Array, "3 3"] = Y_UP) -> None:
    """Write Gaussians as one primitive. extras, rotation: as of `glb_splats.write_glb_splats`.

    Raises: ValueError: none, or more than an SPZ holds.
    """
    path, n = Path(path), len(spool)
    path.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=path.parent) as place:
        packed = Path(place, "splats.spz")
        write_spz(spool, packed, SPZ_VERSION, rotation)
        data = np.fromfile(packed, np.uint8)
    attributes: dict[str, int] = {}
    glb = begin_glb(attributes, extras, {COMPRESSION: {"bufferView": 0}})
    padding = np.zeros(-len(data) % 4, np.uint8)  # what follows the end of a gzip is not read
    glb.add_view([data, padding], len(data) + len(padding))
    attributes["POSITION"] = glb.add_accessor(n, 3, bounds=find_bounds(spool, rotation))
    attributes["COLOR_0"] = glb.add_accessor(n, 4, "|u1", normalized=True)
    attributes[f"{EXTENSION}:SCALE"] = glb.add_accessor(n, 3)
    attributes[f"{EXTENSION}:ROTATION"] = glb.add_accessor(n, 4)
    glb.write(path)
