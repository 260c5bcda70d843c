"""Binary glTF 2.0: one JSON chunk and one chunk of binary data, which is written in parts."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray as Array

import dav_gswt
from dav_gswt.files import atomic_file

MAX_BYTES = 2**32 - 1  # of the whole file: lengths have 32 bits
FLOAT, UNSIGNED_INT, UNSIGNED_BYTE = 5126, 5125, 5121  # component types
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_COMPONENTS = {"<f4": FLOAT, "<u4": UNSIGNED_INT, "|u1": UNSIGNED_BYTE}


@dataclass
class GlbWriter:
    """A glTF asset under construction: what its JSON says, and where the values of its accessors come from.

    Attributes:
        document: the glTF JSON, but for accessors, buffer views and the buffer.
    """

    document: dict[str, Any]
    _accessors: list[dict[str, Any]] = field(default_factory=list)
    _views: list[dict[str, Any]] = field(default_factory=list)
    _sources: list[tuple[int, Iterable[Array]]] = field(default_factory=list)

    def add(
        self,
        parts: Iterable[Array],
        count: int,
        width: int,
        kind: str = "<f4",
        *,
        bounds: tuple[Sequence[float | int], Sequence[float | int]] | None = None,
        normalized: bool = False,
        target: int = ARRAY_BUFFER,
    ) -> int:
        """An accessor of `count` rows of `width` values; its number.

        Args:   parts: arrays of `kind` that hold all rows in their order; read once, when the file is written.
                bounds: the smallest and the largest value of each column; positions must have them.
        """
        view = self.add_view(parts, count * width * np.dtype(kind).itemsize, target)
        return self.add_accessor(count, width, kind, view, bounds=bounds, normalized=normalized)

    def add_view(self, parts: Iterable[Array], size: int, target: int | None = None) -> int:
        """A buffer view of `size` bytes; its number. parts: as of `add`."""
        if size % 4:
            raise ValueError("the bytes of a buffer view must be a multiple of four here")
        offset = self._views[-1]["byteOffset"] + self._views[-1]["byteLength"] if self._views else 0
        view = {"buffer": 0, "byteOffset": offset, "byteLength": size}
        self._views.append(view | ({"target": target} if target else {}))
        self._sources.append((size, parts))
        return len(self._views) - 1

    def add_accessor(
        self,
        count: int,
        width: int,
        kind: str = "<f4",
        view: int | None = None,
        *,
        bounds: tuple[Sequence[float | int], Sequence[float | int]] | None = None,
        normalized: bool = False,
    ) -> int:
        """An accessor of a buffer view; its number. view: None: an extension knows where its values are."""
        accessor: dict[str, Any] = {} if view is None else {"bufferView": view}
        accessor |= {"componentType": _COMPONENTS[kind], "count": count, "type": TYPES[width]}
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor["min"], accessor["max"] = map(list, bounds)
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def add_array(self, values: Array, *, target: int = ARRAY_BUFFER) -> int:
        """An accessor of an array of float32 (n k) or uint32 (n), with its bounds."""
        rows = values.reshape(len(values), -1)
        bounds = ([v.item() for v in rows.min(0)], [v.item() for v in rows.max(0)])
        return self.add(
            [values], len(rows), rows.shape[1], values.dtype.newbyteorder("<").str, bounds=bounds, target=target
        )

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
                if (written := sum(map(file.write, _as_bytes(parts)))) != size:
                    raise ValueError(f"{written} bytes where {size} were announced")


def _as_bytes(parts: Iterable[Array]) -> Iterator[bytes]:
    return (np.ascontiguousarray(values).tobytes() for values in parts)
