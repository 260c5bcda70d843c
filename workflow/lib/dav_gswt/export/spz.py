"""SPZ, versions 2 and 3: gzip of a header and of fixed-point columns. Axes: right, up, back.

Source: https://github.com/nianticlabs/spz. Version 3 differs from 2 in its rotations alone: four bytes instead of
three. Version 4 has another container, which few programs read.
"""

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, UInt8
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.export.axes import Y_UP, turn_points, turn_quats
from dav_gswt.export.spool import Spool
from dav_gswt.files import atomic_file

VERSIONS = (2, 3)
MAGIC = 0x5053474E  # "NGSP"
MAX_GAUSSIANS = 10_000_000  # that readers of versions 2 and 3 take
POSITION_BITS, MAX_FRACTION = 23, 16  # of a coordinate without its sign; most of them after the point
FINER = 64  # steps of a position in a mean standard deviation, where the file's extent leaves room for it
COLOUR_SCALE, SCALE_STEPS, SMALLEST_LOG_SCALE = 0.15, 16, -10.0
RAW_BYTES = {2: 19, 3: 20}  # of a Gaussian before compression


def write_spz(spool: Spool, path: Path | str, version: int = 3, rotation: Float[Array, "3 3"] = Y_UP) -> None:
    """Write Gaussians. rotation: of `axes.AXES`. Raises: ValueError: another version, or none or too many Gaussians."""
    if version not in VERSIONS or not 0 < len(spool) <= MAX_GAUSSIANS:
        raise ValueError(f"SPZ of version {version} with {len(spool)} Gaussians is not written")
    fraction = _choose_fraction(spool)
    header = np.array([MAGIC, version, len(spool)], "<u4").tobytes() + bytes([0, fraction, 0, 0])
    pack_rotations = _pack_first_three if version == 2 else _pack_smallest_three
    columns: list[tuple[str, Callable[[Array], Array]]] = [
        ("means", lambda v: _pack_positions(turn_points(v, rotation), fraction)),
        ("opacity_logits", lambda v: _to_bytes(255 * expit(v.astype(float)))),
        ("dc", lambda v: _to_bytes((COLOUR_SCALE * v.astype(float) + 0.5) * 255)),
        ("log_scales", lambda v: _to_bytes((v.astype(float) - SMALLEST_LOG_SCALE) * SCALE_STEPS)),
        ("quats", lambda v: pack_rotations(turn_quats(v, rotation))),
    ]
    with (
        atomic_file(path) as part,
        part.open("wb") as file,
        gzip.GzipFile("", "wb", 6, file, mtime=0) as packed,  # no name and no time: the same bytes each time
    ):
        packed.write(header)
        for name, pack in columns:
            for values in spool.read(name):
                packed.write(pack(values).tobytes())


def _choose_fraction(spool: Spool) -> int:
    """Bits after the point: as fine as the Gaussians ask for, as coarse as their extent needs."""
    farthest = max(float(np.abs(v).max()) for v in spool.read("means"))
    mean = np.mean([float(np.exp(v.astype(float)).mean()) for v in spool.read("log_scales")])
    wanted = int(np.ceil(np.log2(FINER / mean)))
    room = POSITION_BITS - 1 - int(np.floor(np.log2(max(farthest, 1e-6))))
    return int(np.clip(min(wanted, room), 0, MAX_FRACTION))


def _to_bytes(values: Float[Array, "n k"]) -> UInt8[Array, "n k"]:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)


def _pack_positions(points: Float32[Array, "n 3"], fraction: int) -> UInt8[Array, "n 3 3"]:
    """Fixed point of 24 bits, two's complement, little-endian."""
    most = (1 << POSITION_BITS) - 1
    steps = np.clip(np.round(points.astype(float) * 2.0**fraction), -most, most).astype("<i4")
    return np.ascontiguousarray(steps.view(np.uint8).reshape(-1, 3, 4)[..., :3])


def _pack_first_three(quats: Float32[Array, "n 4"]) -> UInt8[Array, "n 3"]:
    """x, y, z of the rotation whose w is not negative."""
    ahead = np.where(quats[:, :1] < 0, -quats, quats)
    return _to_bytes(ahead[:, 1:].astype(float) * 127.5 + 127.5)


def _pack_smallest_three(quats: Float32[Array, "n 4"]) -> Array:
    """Which of x, y, z, w is the largest (two bits), then the others in order: a sign and nine bits each."""
    xyzw = quats[:, [1, 2, 3, 0]].astype(float)
    largest = np.argmax(np.abs(xyzw), axis=1)
    rows = np.arange(len(xyzw))
    xyzw = np.where(xyzw[rows, largest][:, None] < 0, -xyzw, xyzw)
    others = np.array([[k for k in range(4) if k != which] for which in range(4)])[largest]
    small = xyzw[rows[:, None], others]
    digits = np.minimum(np.abs(small) * (511 * np.sqrt(2)) + 0.5, 511).astype(np.uint32) | (small < 0) * np.uint32(512)
    return (largest.astype(np.uint32) << 30 | digits[:, 0] << 20 | digits[:, 1] << 10 | digits[:, 2]).astype("<u4")
