"""Gaussians as PLY, as SPZ, and as SOG, which splat-transform makes from a PLY (Node.js, and the network once).

SPZ is gzip of a header and of fixed-point columns (https://github.com/nianticlabs/spz). Versions 2 and 3 differ in
their rotations alone: three bytes or four. Version 4 has another container, which few programs read.
"""

import gzip
import shutil
import subprocess
from collections.abc import Callable
from io import BufferedIOBase
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, UInt8
from numpy import ndarray as Array
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_DOWN, Y_UP, turn_points, turn_quats
from dav_gswt.export.spool import Spool
from dav_gswt.files import atomic_file

PROPERTIES = [*("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")]
PROPERTIES += [*("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")]
MAGIC = 0x5053474E  # "NGSP"
MAX_GAUSSIANS = 10_000_000  # that readers of SPZ 2 and 3 take
POSITION_BITS, MAX_FRACTION = 23, 16  # of a coordinate without its sign; most of them after the point
FINER = 64  # steps of a position in a mean standard deviation, where the file's extent leaves room for it
COLOUR_SCALE, SCALE_STEPS, SMALLEST_LOG_SCALE = 0.15, 16, -10.0
PACKAGE = "@playcanvas/splat-transform@2.7.1"


def write_ply(spool: Spool, path: Path | str) -> None:
    """Write the standard 3DGS PLY, y down, all columns float32."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(spool)}"]
    lines += [*(f"property float {name}" for name in PROPERTIES), "end_header"]
    columns = map(spool.read, ("means", "dc", "opacity_logits", "log_scales", "quats"))
    with atomic_file(path) as part, part.open("wb") as file:
        file.write("\n".join(lines).encode() + b"\n")
        for points, dc, opacities, scales, quats in zip(*columns, strict=True):
            means = turn_points(points, Y_DOWN)
            parts = [means, np.zeros_like(means), dc, opacities, scales, turn_quats(quats, Y_DOWN)]
            file.write(np.concatenate(parts, axis=1, dtype="<f4").tobytes())


def find_npx() -> str:
    """The program that runs splat-transform. Raises: InputError: it is not here."""
    if (npx := shutil.which("npx")) is None:
        raise InputError("exports: SOG needs Node.js 20 or newer with npx, which is not here; PLY, SPZ and GLB do not")
    return npx


def write_sog(spool: Spool, path: Path) -> None:
    """Write a SOG, y down. Raises: InputError: no Node.js, or what the converter complains of."""
    source = path.with_name(".sog.ply")
    write_ply(spool, source)
    command = [find_npx(), "--yes", PACKAGE, "-w", "-q", str(source), str(path), "-g", "cpu"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        message = " ".join((done.stderr or done.stdout).strip().splitlines()[-3:])
        raise InputError(f"exports: {PACKAGE} failed: {message or done.returncode}")
    source.unlink()


def write_spz(spool: Spool, path: Path | str, version: int = 3) -> None:
    """Write Gaussians, y up. Raises: ValueError: see `pack_spz`."""
    with atomic_file(path) as part, part.open("wb") as file:
        pack_spz(spool, file, version)


def pack_spz(spool: Spool, file: BufferedIOBase, version: int) -> None:
    """Write an SPZ, y up, to an open file. Raises: ValueError: another version, or none or too many Gaussians."""
    if version not in (2, 3) or not 0 < len(spool) <= MAX_GAUSSIANS:
        raise ValueError(f"SPZ of version {version} with {len(spool)} Gaussians is not written")
    fraction = _choose_fraction(spool)
    pack_rotations = _pack_first_three if version == 2 else _pack_smallest_three
    columns: list[tuple[str, Callable[[Array], Array]]] = [
        ("means", lambda v: _pack_positions(turn_points(v, Y_UP), fraction)),
        ("opacity_logits", lambda v: _to_bytes(255 * expit(v.astype(float)))),
        ("dc", lambda v: _to_bytes((COLOUR_SCALE * v.astype(float) + 0.5) * 255)),
        ("log_scales", lambda v: _to_bytes((v.astype(float) - SMALLEST_LOG_SCALE) * SCALE_STEPS)),
        ("quats", lambda v: pack_rotations(turn_quats(v, Y_UP))),
    ]
    with gzip.GzipFile("", "wb", 6, file, mtime=0) as packed:  # no name and no time: the same bytes each time
        packed.write(np.array([MAGIC, version, len(spool)], "<u4").tobytes() + bytes([0, fraction, 0, 0]))
        for name, pack in columns:
            for values in spool.read(name):
                packed.write(pack(values).tobytes())


def _choose_fraction(spool: Spool) -> int:
    """Bits after the point: as fine as the Gaussians need, as coarse as their extent requires."""
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
