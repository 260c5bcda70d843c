"""Binary glTF 2.0, written in parts, and Gaussians in it (KHR_gaussian_splatting, ratified 2026).

Source: https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting. A program that
does not know the extension shows coloured points. The compressed form, which CesiumJS draws, holds an SPZ of version 2:
https://github.com/CesiumGS/glTF/tree/draft-splat-spz/extensions/2.0/Khronos (a draft).
"""

import io
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
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

MAX_BYTES = 2**32 - 1  # of the whole file: lengths have 32 bits
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
COMPONENTS = {"<f4": 5126, "<u4": 5125, "|u1": 5121}
EXTENSION = "KHR_gaussian_splatting"
COMPRESSION = "KHR_gaussian_splatting_compression_spz_2"

Bounds = tuple[Sequence[float | int], Sequence[float | int]]  # the smallest and the largest value of each column


@dataclass
class GlbWriter:
    """A glTF asset under construction. document: its JSON without accessors, buffer views and the buffer."""

    document: dict[str, Any]
    _accessors: list[dict[str, Any]] = field(default_factory=list)
    _views: list[dict[str, Any]] = field(default_factory=list)
    _sources: list[tuple[int, Iterable[Array]]] = field(default_factory=list)

    def add(
        self,
        parts: Iterable[Array] | None,
        count: int,
        width: int,
        kind: str = "<f4",
        *,
        bounds: Bounds | None = None,
        normalized: bool = False,
        target: int = ARRAY_BUFFER,
    ) -> int:
        """Add an accessor of `count` rows of `width` values; returns its number.

        Args:   parts: arrays of `kind` that hold all rows in order; read once, when the file is written. None: an
                extension knows where the values are. bounds: required for positions.
        """
        accessor: dict[str, Any] = {}
        if parts is not None:
            accessor["bufferView"] = self.add_view(parts, count * width * np.dtype(kind).itemsize, target)
        accessor |= {"componentType": COMPONENTS[kind], "count": count, "type": TYPES[width]}
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor["min"], accessor["max"] = map(list, bounds)
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def add_view(self, parts: Iterable[Array], size: int, target: int | None = None) -> int:
        """Add a buffer view of `size` bytes, a multiple of four; returns its number. parts: as in `add`."""
        offset = sum(size for size, _ in self._sources)
        view = {"buffer": 0, "byteOffset": offset, "byteLength": size}
        self._views.append(view | ({"target": target} if target else {}))
        self._sources.append((size, parts))
        return len(self._views) - 1

    def add_array(self, values: Array, *, target: int = ARRAY_BUFFER) -> int:
        """Add an accessor of an array of float32 (n k) or uint32 (n), with its bounds."""
        rows = values.reshape(len(values), -1)
        bounds = rows.min(0).tolist(), rows.max(0).tolist()
        kind = values.dtype.newbyteorder("<").str
        return self.add([values], len(rows), rows.shape[1], kind, bounds=bounds, target=target)

    def write(self, path: Path | str) -> None:
        """Write the file, whole or not at all. Raises: ValueError: it would be longer than MAX_BYTES."""
        length = sum(size for size, _ in self._sources)
        asset = {"version": "2.0", "generator": f"DAV-GSWT {dav_gswt.__version__}"}
        document = {"asset": asset} | self.document
        document |= {"accessors": self._accessors, "bufferViews": self._views, "buffers": [{"byteLength": length}]}
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + length
        if total > MAX_BYTES:
            raise ValueError(f"{path}: {total} bytes are more than a GLB holds")
        with atomic_file(path) as part, part.open("wb") as file:
            file.write(b"glTF" + np.array([2, total, len(text)], "<u4").tobytes() + b"JSON" + text)
            file.write(np.array([length], "<u4").tobytes() + b"BIN\0")
            for size, parts in self._sources:
                if (written := sum(file.write(np.ascontiguousarray(v).tobytes()) for v in parts)) != size:
                    raise ValueError(f"{written} bytes where {size} were announced")


def write_splats(spool: Spool, path: Path | str, extras: dict[str, Any], compressed: bool = False) -> None:
    """Write Gaussians as one primitive, y up. extras: of its node.

    Raises: ValueError: compressed: none, or more than an SPZ holds.
    """
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
    attributes: dict[str, int] = {}
    primitive = {"mode": 0, "attributes": attributes, "extensions": {EXTENSION: splats}}
    nodes = {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "terrain", "extras": extras}]}
    glb = GlbWriter(used | nodes | {"meshes": [{"name": "terrain", "primitives": [primitive]}]})
    if compressed:
        packed = io.BytesIO()
        pack_spz(spool, packed, 2)
        packed.write(bytes(-packed.tell() % 4))  # readers stop at the end of the gzip
        glb.add_view([np.frombuffer(packed.getbuffer(), np.uint8)], packed.tell())

    def add(name: str, parts: Iterable[Array], width: int, kind: str = "<f4", **more: Any) -> None:
        attributes[name] = glb.add(None if compressed else parts, len(spool), width, kind, **more)

    scales = (np.exp(v.astype(float)).astype(np.float32) for v in spool.read("log_scales"))
    quats = (turn_quats(v, Y_UP)[:, [1, 2, 3, 0]] for v in spool.read("quats"))
    points = (turn_points(v, Y_UP) for v in spool.read("means"))
    add("POSITION", points, 3, bounds=_find_bounds(spool))
    add("COLOR_0", _read_fallback(spool), 4, "|u1", normalized=True)
    add(f"{EXTENSION}:SCALE", scales, 3)
    add(f"{EXTENSION}:ROTATION", quats, 4)
    if not compressed:
        add(f"{EXTENSION}:OPACITY", map(_to_opacity, spool.read("opacity_logits")), 1)
        add(f"{EXTENSION}:SH_DEGREE_0_COEF_0", spool.read("dc"), 3)
    glb.write(path)


def _to_opacity(logits: Float32[Array, "n 1"]) -> Float32[Array, "n 1"]:
    return expit(logits.astype(float)).astype(np.float32)


def _find_bounds(spool: Spool) -> Bounds:
    """The smallest and the largest of each coordinate, as it is stored."""
    ends = [(p.min(0), p.max(0)) for p in (turn_points(v, Y_UP) for v in spool.read("means"))]
    return np.min([low for low, _ in ends], 0).tolist(), np.max([high for _, high in ends], 0).tolist()


def _read_fallback(spool: Spool) -> Iterator[Array]:
    """COLOR_0: linear colour and opacity in bytes."""
    for dc, logits in zip(spool.read("dc"), spool.read("opacity_logits"), strict=True):
        encoded = np.clip(0.5 + SH0 * dc.astype(float), 0, 1)
        linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        yield np.round(255 * np.concatenate([linear, _to_opacity(logits)], 1)).astype(np.uint8)
