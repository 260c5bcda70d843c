"""Chunks: one tile at one level as the viewer's bytes, 32 a splat, followed by its orders."""

import hashlib
from pathlib import Path

import numpy as np
from jaxtyping import UInt32
from numpy import ndarray as Array

from dav_gswt.bundle import orders
from dav_gswt.errors import InputError
from dav_gswt.field import Field, sh_of

RECORD = np.dtype([("position", "<f4", 3), ("sigma", "<f4", 3), ("rgba", "u1", 4), ("quat", "u1", 4)])
assert RECORD.itemsize == 32


def records(field: Field) -> Array:
    """Splats in stored form: 8 bits a channel for base colour and opacity, 7 and a sign for a unit quaternion, w >=
    0.
    """
    rows = np.empty(len(field), RECORD)
    rows["position"] = field.means
    rows["sigma"] = np.exp(field.log_scales)
    opacity = 1 / (1 + np.exp(-field.opacity_logits.astype(float)))
    rgba = np.concatenate([np.clip(field.base_colours.astype(float), 0, 1), opacity[:, None]], 1)
    rows["rgba"] = np.rint(255 * rgba)
    quats = field.quats.astype(float)
    quats *= np.where(quats[:, :1] < 0, -1, 1) / np.linalg.norm(quats, axis=1, keepdims=True)
    rows["quat"] = np.clip(np.rint(128 * quats + 128), 0, 255)
    return rows


def write(field: Field, kept: list[int], path: Path) -> dict:
    """Write a chunk with an order for each kept direction; returns its part of the manifest without level and file."""
    along = orders.directions()
    parts = [records(field).tobytes()]
    parts += [orders.back_to_front(field.means, along[k]).astype("<u4").tobytes() for k in kept]
    data = b"".join(parts)
    path.write_bytes(data)
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest(), "count": len(field), "orders": kept}


def read(folder: Path | str, entry: dict) -> tuple[Field, UInt32[Array, "d n"]]:
    """Splats (to 8 bits, degree 0, nothing known of ground or doubt) and orders of one manifest entry.

    Raises: InputError: the file is missing, has another size or digest than the manifest says, or an order is none.
    """
    path = Path(folder) / entry["file"]
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: not readable ({error.strerror}); make the bundle again") from None
    count, kept = entry["count"], len(entry["orders"])
    if len(data) != entry["bytes"] or len(data) != count * (RECORD.itemsize + 4 * kept):
        raise InputError(f"{path}: {len(data)} bytes where the manifest says {entry['bytes']}; make the bundle again")
    if hashlib.sha256(data).hexdigest() != entry["sha256"]:
        raise InputError(f"{path}: its digest is not the manifest's; make the bundle again")
    rows = np.frombuffer(data, RECORD, count)
    order = np.frombuffer(data, "<u4", offset=count * RECORD.itemsize).reshape(kept, count)
    if kept and (np.sort(order, axis=1) != np.arange(count)).any():
        raise InputError(f"{path}: an order does not hold every splat once; make the bundle again")
    rgba = rows["rgba"].astype(np.float32) / 255
    opacity = np.clip(rgba[:, 3].astype(float), 0.5 / 255, 1 - 0.5 / 255)
    field = Field(
        rows["position"].astype(np.float32),
        np.log(np.maximum(rows["sigma"], 1e-30)).astype(np.float32),
        ((rows["quat"].astype(np.float32) - 128) / 127).astype(np.float32),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        sh_of(rgba[:, :3]),
        np.zeros(count, np.float32),
        np.zeros(count, bool),
    )
    return field, order.astype(np.uint32)
