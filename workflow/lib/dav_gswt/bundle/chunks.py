"""Chunks: one tile at one level as the viewer's bytes, a record of 16 a splat, followed by its orders."""

import hashlib
from pathlib import Path

import numpy as np
from jaxtyping import Integer
from numpy import ndarray as Array

from dav_gswt.bundle.encoding import RECORD, Encoding
from dav_gswt.bundle.orders import index_type
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField


def chunk_size(count: int, orders: int) -> int:
    """Bytes of a chunk: two a splat and order, four from 65536 splats on."""
    return count * (RECORD.itemsize + orders * index_type(count).itemsize)


def write_chunk(rows: Array, order: Integer[Array, "d n"], path: Path) -> dict:
    """Write records and orders; returns what the manifest says of the file's bytes."""
    data = rows.tobytes() + order.astype(index_type(len(rows))).tobytes()
    path.write_bytes(data)
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest(), "count": len(rows)}


def read_chunk(folder: Path | str, entry: dict, encoding: Encoding) -> tuple[GaussianField, Integer[Array, "d n"]]:
    """Splats (as they were rounded, nothing known of ground or doubt) and orders of one manifest entry.

    Raises: InputError: the file lies outside of the folder, is missing, has another size (looked at before anything
    is read) or digest than the manifest says, or an order does not hold every splat once.
    """
    folder = Path(folder)
    path, count, kept = folder / entry["file"], entry["count"], len(entry["orders"])
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{path}: lies outside of the bundle; make the bundle again")
    try:
        size = path.stat().st_size
        if size != entry["bytes"] or size != chunk_size(count, kept):
            raise InputError(f"{path}: {size} bytes where the manifest says {entry['bytes']}; make the bundle again")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: not readable ({error.strerror}); make the bundle again") from None
    if len(data) != size or hashlib.sha256(data).hexdigest() != entry["sha256"]:
        raise InputError(f"{path}: its digest is not the manifest's; make the bundle again")
    rows = np.frombuffer(data, RECORD, count)
    order = np.frombuffer(data, index_type(count), offset=count * RECORD.itemsize).reshape(kept, count)
    if kept and (np.sort(order, axis=1, kind="stable") != np.arange(count)).any():
        raise InputError(f"{path}: an order does not hold every splat once; make the bundle again")
    return encoding.decode(rows), order
