"""Chunks: one tile at one level, as the bytes that a viewer loads.

A chunk of n splats and d orders is, without padding and little-endian,

    offset 0        n records of 16 bytes (`encoding.RECORD`)
    offset 16 n     d orders of n indices each: uint16 where n < 65536, else uint32

An order lists the records from back to front for one viewing direction; the manifest's `orders` says, in the same
sequence, which of its `directions` these are.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Integer
from numpy import ndarray as Array
from pydantic import Field

from dav_gswt.bundle.encoding import RECORD, Encoding, Entry, Natural
from dav_gswt.bundle.orders import index_type
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField


@dataclass(frozen=True)
class ChunkEntry(Entry):
    """A chunk in the manifest: its path relative to the manifest, size and digest of the file, number of splats.

    orders: the directions that it keeps orders for, as indices into the manifest's `directions`.
    """

    level: Natural
    orders: Annotated[list[Natural], Field(min_length=1)]
    file: Annotated[str, Field(pattern=r"^chunks/[A-Za-z0-9_]+\.bin$")]
    bytes: Natural
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    count: Annotated[int, Field(ge=1)]


def chunk_size(count: int, orders: int) -> int:
    """Bytes of a chunk."""
    return count * (RECORD.itemsize + orders * index_type(count).itemsize)


def write_chunk(
    rows: Array, order: Integer[Array, "d n"], folder: Path | str, file: str, level: int, kept: list[int]
) -> ChunkEntry:
    """Write records and orders to `file` in a bundle's folder; returns the chunk's entry in the manifest.

    kept: the directions of the orders.
    """
    data = rows.tobytes() + order.astype(index_type(len(rows))).tobytes()
    (Path(folder) / file).write_bytes(data)
    digest = hashlib.sha256(data).hexdigest()
    return ChunkEntry(level, kept, file, len(data), digest, len(rows))


def read_exactly(folder: Path | str, name: str, size: int, sha256: str) -> bytes:
    """The bytes of a file of a bundle or a page.

    Raises: InputError: the file lies outside of the folder, is missing, has another size (checked before anything is
    read) or another digest.
    """
    path = Path(folder) / name
    if not path.resolve().is_relative_to(Path(folder).resolve()):
        raise InputError(f"{path}: lies outside of the folder; make the bundle again")
    try:
        if (found := path.stat().st_size) != size:
            raise InputError(f"{path}: {found} bytes where the manifest says {size}; make the bundle again")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: not readable ({error.strerror}); make the bundle again") from None
    if hashlib.sha256(data).hexdigest() != sha256:
        raise InputError(f"{path}: its digest is not the manifest's; make the bundle again")
    return data


def read_chunk(
    folder: Path | str, entry: ChunkEntry, encoding: Encoding
) -> tuple[GaussianField, Integer[Array, "d n"]]:
    """Read the splats of a chunk, as they were rounded, and its orders. Ground and uncertainty are not stored.

    Raises: InputError: see `read_exactly`; an order does not hold every splat once.
    """
    count, kept = entry.count, len(entry.orders)
    data = read_exactly(folder, entry.file, chunk_size(count, kept), entry.sha256)
    rows = np.frombuffer(data, RECORD, count)
    order = np.frombuffer(data, index_type(count), offset=count * RECORD.itemsize).reshape(kept, count)
    if (np.sort(order, axis=1, kind="stable") != np.arange(count)).any():
        path = Path(folder) / entry.file
        raise InputError(f"{path}: an order does not hold every splat once; make the bundle again")
    return encoding.decode(rows), order
