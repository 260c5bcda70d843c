"""Snapshots of a fit: killed at any moment it goes on from the last one, and ends with the same bytes.

A snapshot lies outside the outputs, under the digest of all that the result depends on, and goes when the fit ends.
Arrays in an .npz without pickle, all else as JSON in it.
"""

import hashlib
import json
import logging
import time
from pathlib import Path

import numpy as np
from numpy import ndarray as Array

import dav_gswt.reconstruction.fitting
from dav_gswt.files import UNREADABLE, atomic_file

_log = logging.getLogger(__name__)

EVERY = 20.0  # seconds between two snapshots: when one is taken changes no result


def key(*parts) -> str:
    """Digest of arrays, of whatever has a plain text, and of this package's code."""
    state = hashlib.sha256()
    for path in sorted(Path(dav_gswt.reconstruction.fitting.__file__).parent.glob("*.py")):
        state.update(path.read_bytes())
    for part in parts:
        if isinstance(part, np.ndarray):
            state.update(f"{part.dtype}{part.shape}".encode())
            state.update(np.ascontiguousarray(part).tobytes())
        else:
            state.update(repr(part).encode())
    return state.hexdigest()[:32]


class Keeper:
    """Where one fit's snapshot lies. folder: None keeps none."""

    def __init__(self, folder: Path | str | None, name: str):
        self.path = Path(folder) / f"{name}.npz" if folder else None
        self._last = time.monotonic()

    def due(self) -> bool:
        """It is time for another snapshot."""
        return self.path is not None and time.monotonic() - self._last >= EVERY

    def save(self, arrays: dict[str, Array], rest: dict) -> None:
        """Keep this moment; a snapshot that cannot be written costs the fit nothing."""
        try:
            with atomic_file(self.path) as part, part.open("wb") as file:
                np.savez(file, rest=np.frombuffer(json.dumps(rest).encode(), np.uint8), **arrays)
        except OSError as error:
            _log.warning("no snapshot of the fit: %s", error)
        self._last = time.monotonic()

    def load(self) -> tuple[dict[str, Array], dict] | None:
        """The last moment kept, if there is one that can be read."""
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
        """The fit has ended."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
