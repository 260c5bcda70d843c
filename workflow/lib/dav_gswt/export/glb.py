"""Binary glTF 2.0, written in parts, and Gaussians in it (KHR_gaussian_splatting, ratified 2026).

Source: https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting. A program that
does not know the extension shows coloured points. The compressed form, which CesiumJS draws, holds an SPZ of version 2:
https://github.com/CesiumGS/glTF/tree/draft-splat-spz/extensions/2.0/Khronos (a draft).
"""

import io
import json
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array
from scipy.special import expit

import dav_gswt
from dav_gswt.export.axes import Y_UP, turn_points, turn_quats
from dav_gswt.export.splat_files import pack_spz
from dav_gswt.export.spool import Spool
from dav_gswt.field import SH0
from dav_gswt.files import atomic_file

ARRAY_BUFFER = 34962
ELEMENT_ARRAY_BUFFER = 34963
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
COMPONENTS = {"<f4": 5126, "|u1": 5121}
EXTENSION = "KHR_gaussian_splatting"
COMPRESSION = "KHR_gaussian_splatting_compression_spz_2"


def write_splats(spool: Spool, path: Path | str, extras: dict[str, Any], compressed: bool = False) -> None:
    """Write Gaussians as one primitive, y up. extras: of its node.

    Raises: ValueError: compressed: none, or more than an SPZ holds.
    """
    scales = (np.exp(v.astype(float)).astype(np.float32) for v in spool.read("log_scales"))
    quats = (turn_quats(v, Y_UP)[:, [1, 2, 3, 0]] for v in spool.read("quats"))
    points = (turn_points(v, Y_UP) for v in spool.read("means"))
    columns: dict[str, tuple[Iterable[Array], int, str, dict[str, Any]]] = {
        "POSITION": (points, 3, "<f4", _find_bounds(spool)),
        "COLOR_0": (_read_fallback(spool), 4, "|u1", {"normalized": True}),
        f"{EXTENSION}:SCALE": (scales, 3, "<f4", {}),
        f"{EXTENSION}:ROTATION": (quats, 4, "<f4", {}),
    }
    if not compressed:
        columns[f"{EXTENSION}:OPACITY"] = map(_to_opacity, spool.read("opacity_logits")), 1, "<f4", {}
        columns[f"{EXTENSION}:SH_DEGREE_0_COEF_0"] = spool.read("dc"), 3, "<f4", {}
    accessors, views, length = [], [], 0
    for _, width, kind, more in columns.values():
        accessor = {"componentType": COMPONENTS[kind], "count": len(spool), "type": TYPES[width]} | more
        if not compressed:
            size = len(spool) * width * np.dtype(kind).itemsize
            accessor = {"bufferView": len(views)} | accessor
            views.append({"buffer": 0, "byteOffset": length, "byteLength": size, "target": ARRAY_BUFFER})
            length += size
        accessors.append(accessor)
    binary = chain.from_iterable(parts for parts, _, _, _ in columns.values())
    splats: dict[str, Any] = {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "sortingMethod": "cameraDistance",
        "projection": "perspective",
    }
    used: dict[str, Any] = {"extensionsUsed": [EXTENSION]}
    if compressed:
        splats["extensions"] = {COMPRESSION: {"bufferView": 0}}
        used = {name: [EXTENSION, COMPRESSION] for name in ("extensionsUsed", "extensionsRequired")}
        packed = io.BytesIO()
        pack_spz(spool, packed, 2)
        packed.write(bytes(-packed.tell() % 4))  # readers stop at the end of the gzip
        length, binary = packed.tell(), [np.frombuffer(packed.getbuffer(), np.uint8)]
        views = [{"buffer": 0, "byteOffset": 0, "byteLength": length}]
    attributes = {name: number for number, name in enumerate(columns)}
    primitive = {"mode": 0, "attributes": attributes, "extensions": {EXTENSION: splats}}
    document = {
        **used,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "terrain", "extras": extras}],
        "meshes": [{"name": "terrain", "primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": length}],
    }
    _write_glb(path, document, length, binary)


def _write_glb(path: Path | str, document: dict[str, Any], length: int, binary: Iterable[Array]) -> None:
    """Write a glTF asset, whole or not at all. document: without the asset. binary: arrays of `length` bytes."""
    asset = {"version": "2.0", "generator": f"DAV-GSWT {dav_gswt.__version__}"}
    text = json.dumps({"asset": asset} | document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + length
    with atomic_file(path) as part, part.open("wb") as file:
        file.write(b"glTF" + np.array([2, total, len(text)], "<u4").tobytes() + b"JSON" + text)
        file.write(np.array([length], "<u4").tobytes() + b"BIN\0")
        for values in binary:
            file.write(np.ascontiguousarray(values).tobytes())


def _to_opacity(logits: Float32[Array, "n 1"]) -> Float32[Array, "n 1"]:
    return expit(logits.astype(float)).astype(np.float32)


def _find_bounds(spool: Spool) -> dict[str, list[float]]:
    """The smallest and the largest of each coordinate, as it is stored."""
    ends = [(p.min(0), p.max(0)) for p in (turn_points(v, Y_UP) for v in spool.read("means"))]
    low, high = zip(*ends, strict=True)
    return {"min": np.min(low, 0).tolist(), "max": np.max(high, 0).tolist()}


def _read_fallback(spool: Spool) -> Iterator[Array]:
    """COLOR_0: linear colour and opacity in bytes."""
    for dc, logits in zip(spool.read("dc"), spool.read("opacity_logits"), strict=True):
        encoded = np.clip(0.5 + SH0 * dc.astype(float), 0, 1)
        linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        yield np.round(255 * np.concatenate([linear, _to_opacity(logits)], 1)).astype(np.uint8)
