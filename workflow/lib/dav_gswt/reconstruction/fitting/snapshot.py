"""Snapshots of a fit: a killed fit continues from the last one and ends with the same bytes.

A snapshot lies outside the outputs, is named by a digest of all that the result depends on, and is deleted when the fit
ends. Arrays are in an .npz without pickle, the rest is JSON in it.
"""

import hashlib
import json
import logging
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray as Array

from dav_gswt.files import UNREADABLE, atomic_file
from dav_gswt.photos.training_views import release_pages

_log = logging.getLogger(__name__)

EVERY = 20.0  # seconds between snapshots; results do not depend on them


def digest_inputs(*parts) -> str:
    """Digest of arrays, of the attributes of objects that have some, and of the repr of other values."""
    state = hashlib.sha256()
    for part in parts:
        _update(state, part)
    return state.hexdigest()[:32]


def _update(state: "hashlib._Hash", part: Any) -> None:
    if isinstance(part, np.ndarray):
        state.update(f"{part.dtype}{part.shape}".encode())
        state.update(np.ascontiguousarray(part).data)
        release_pages(part)
    elif hasattr(part, "__dict__"):
        for name, value in vars(part).items():
            state.update(name.encode())
            _update(state, value)
    else:
        state.update(f"{part!r};".encode())


class SnapshotStore:
    """The file of one fit's snapshot. folder: None stores none."""

    def __init__(self, folder: Path | str | None, name: str):
        self.path = Path(folder) / f"{name}.npz" if folder else None
        self._last = time.monotonic()

    def due(self) -> bool:
        """Whether it is time for another snapshot."""
        return self.path is not None and time.monotonic() - self._last >= EVERY

    def save(self, arrays: dict[str, Array], rest: dict) -> None:
        """Store a snapshot; one that cannot be written is only a warning."""
        assert self.path is not None
        try:
            with atomic_file(self.path) as part, part.open("wb") as file:
                text = np.frombuffer(json.dumps(rest).encode(), np.uint8)
                np.savez(file, rest=text, **arrays)  # pyright: ignore[reportArgumentType]  no array is named allow_pickle
        except OSError as error:
            _log.warning("no snapshot of the fit: %s", error)
        self._last = time.monotonic()

    def load(self) -> tuple[dict[str, Array], dict] | None:
        """The stored snapshot, if there is a readable one."""
        if self.path is None or not self.path.exists():
            return None
        try:
            with np.load(self.path, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            return arrays, json.loads(arrays.pop("rest").tobytes())
        except UNREADABLE as error:
            _log.warning("%s is not a snapshot (%s): the fit begins anew", self.path, error)
            return None

    def clear(self) -> None:
        """Delete the snapshot: the fit has ended."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
