"""Finished splats as other programs store them: `.ply` and `.spz` (versions 1 to 3), without harmonics.

SPZ is gzip of a header and of fixed-point columns (https://github.com/nianticlabs/spz). Sizes are checked before
anything is allocated.
"""

import gzip
from pathlib import Path

import numpy as np
from jaxtyping import Float32, UInt8
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.field import Splats, build_field, read_ply
from dav_gswt.files import UNREADABLE
from dav_gswt.images.file_kinds import advise_conversion, detect_kind
from dav_gswt.packed_ply import expand_smallest_three

SPZ_MAGIC, SPZ_HEADER, SPZ_SMALLEST, SPZ_COLOUR = 0x5053474E, 16, -10.0, 0.15
MOST_PACKED = 1032  # times that gzip can make a file smaller
MOST_GAUSSIANS = 100_000_000


def read_splat(path: Path | str) -> Splats:
    """Read a finished splat of any kind, its colours without their view-dependent part.

    Raises: InputError: no such file, a kind that is not read, with the command that converts it, or a broken file.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    kind = detect_kind(path)
    if advice := advise_conversion(path, kind):
        raise InputError(f"{path}: {advice}")
    if kind != "spz":
        return read_ply(path, harmonics=False)
    try:
        return _read_spz(path)
    except UNREADABLE as error:
        raise InputError(f"{path}: not a readable .spz ({summarize_error(error)}); copy or export it again") from error


def _read_spz(path: Path) -> Splats:
    with gzip.open(path) as file:
        header = _read_exactly(file, SPZ_HEADER)
        magic, version, n = np.frombuffer(header, "<u4", 3).tolist()
        degree, fraction = header[12], header[13]
        if magic != SPZ_MAGIC or version not in (1, 2, 3) or degree > 4 or fraction > 24:
            raise InputError(f"{path}: not an SPZ of version 1, 2 or 3; copy or export it again")
        place, turn = 2 if version == 1 else 3, 4 if version == 3 else 3
        room = MOST_PACKED * path.stat().st_size
        if not 0 < n <= MOST_GAUSSIANS or n * (3 * place + turn + 7) > room:
            raise InputError(f"{path}: the header announces {n} Gaussians, not what the file holds; is it cut short?")
        sizes = (3 * place, 1, 3, 3, turn)
        places, opacities, colours, scales, turns = (
            np.frombuffer(_read_exactly(file, n * each), np.uint8).reshape(n, each) for each in sizes
        )
    field = build_field(
        path,
        means=places.view("<f2").astype(np.float32) if version == 1 else _unpack_places(places, fraction),
        sh=colours[:, None] * np.float32(1 / 255 / SPZ_COLOUR) + np.float32(-0.5 / SPZ_COLOUR),
        log_scales=scales / np.float32(16) + np.float32(SPZ_SMALLEST),
        quats=_unpack_smallest_three(turns.view("<u4")[:, 0]) if version == 3 else _unpack_first_three(turns),
        opacity_logits=_unpack_opacities(opacities[:, 0]),
    )
    return Splats(field, np.zeros(3), degree)


def _read_exactly(file: gzip.GzipFile, size: int) -> bytes:
    data = file.read(size)
    if len(data) != size:
        raise EOFError("it ends too early")
    return data


def _unpack_opacities(values: UInt8[Array, "n"]) -> Float32[Array, "n"]:
    """Logits; those of 0 and 255 are infinite."""
    with np.errstate(divide="ignore"):
        return (np.log(values.astype(np.float32)) - np.log(255 - values.astype(np.float32))).astype(np.float32)


def _unpack_places(values: UInt8[Array, "n 9"], fraction: int) -> Float32[Array, "n 3"]:
    """Fixed point of 24 bits, two's complement, little-endian."""
    wide = np.zeros((len(values), 3, 4), np.uint8)
    wide[..., 1:] = values.reshape(-1, 3, 3)  # the sign is in the uppermost byte
    return (wide.view("<i4")[..., 0] >> 8).astype(np.float32) / np.float32(2**fraction)


def _unpack_first_three(values: UInt8[Array, "n 3"]) -> Float32[Array, "n 4"]:
    xyz = values / np.float32(127.5) - np.float32(1)
    return np.column_stack([np.sqrt(np.maximum(1 - (xyz**2).sum(1), 0)), xyz])


def _unpack_smallest_three(words: Array) -> Float32[Array, "n 4"]:
    """w x y z from which of x, y, z, w is the largest (two bits), then the others in order: a sign and nine bits."""
    digits = words[:, None] >> np.array([20, 10, 0], np.uint32) & 1023
    small = (digits & 511) * np.float32(np.sqrt(0.5) / 511) * np.where(digits & 512, -1, 1).astype(np.float32)
    return np.ascontiguousarray(expand_smallest_three(words >> 30, small)[:, [3, 0, 1, 2]])
