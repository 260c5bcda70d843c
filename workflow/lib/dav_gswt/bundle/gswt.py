"""gswt.zip: the tile set as the public GSWT web renderer reads it (tiles 4.0 wide, 62 floats a splat).

Its loader never reads property names and crashes on one header line too many, so nothing here is optional.
"""

import zipfile
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import Field
from dav_gswt.logs import progress

WIDTH = 4.0
MOST = 8_388_608
STAMP = (1980, 1, 1, 0, 0, 0)  # the earliest a zip knows: the same tiles give the same bytes
PROPERTIES = [
    *("x", "y", "z", "nx", "ny", "nz"),
    *(f"f_dc_{i}" for i in range(3)),
    *(f"f_rest_{i}" for i in range(45)),
    "opacity",
    *(f"scale_{i}" for i in range(3)),
    *(f"rot_{i}" for i in range(4)),
]


def rows(field: Field, side: float) -> Float32[Array, "n 62"]:
    """Splats of a tile `side` wide, scaled to WIDTH; view-dependent colour is left out, quaternions have length 1."""
    scale = WIDTH / side
    out = np.zeros((len(field), len(PROPERTIES)), np.float32)
    out[:, :3] = field.means.astype(float) * scale
    out[:, :2] = np.clip(out[:, :2], 0, WIDTH)
    out[:, 6:9] = field.sh[:, 0]
    out[:, 54] = field.opacity_logits
    out[:, 55:58] = field.log_scales + np.log(scale)
    quats = field.quats.astype(float)  # a length that float32 cannot square must not overflow on the way
    out[:, 58:] = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    return out


def ply(values: Float32[Array, "n 62"]) -> bytes:
    """The renderer's PLY: 65 header lines before end_header, no comment."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(values)}"]
    lines += [f"property float {name}" for name in PROPERTIES]
    return "\n".join([*lines, "end_header\n"]).encode("ascii") + values.astype("<f4").tobytes()


def write(fields: list[list[Field]], side: float, path: Path) -> None:
    """Write fields[level][tile] as lod{L}_tile_{T}.ply entries, in a fixed order with a fixed time.

    Raises: InputError: a tile has no splat, there are more than the renderer takes, or a value is not finite.
    """
    total = sum(len(field) for level in fields for field in level)
    if total > MOST:
        raise InputError(f"{path.name}: {total} splats, the renderer takes {MOST}; use smaller tiles or fewer variants")
    flat = [(level, tile, field) for level, tiles in enumerate(fields) for tile, field in enumerate(tiles)]
    with zipfile.ZipFile(path, "w") as archive:
        for level, tile, field in progress(flat, "write gswt.zip"):
            if not len(field):
                raise InputError(f"level {level}, tile {tile}: no splat in it; the field has a hole as wide as a tile")
            values = rows(field, side)
            if not np.isfinite(values).all():
                raise InputError(f"level {level}, tile {tile}: a value is not finite")
            entry = zipfile.ZipInfo(f"lod{level}_tile_{tile:02d}.ply", STAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, ply(values), compresslevel=1)
