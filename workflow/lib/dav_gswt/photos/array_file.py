"""Arrays that lie in files and are read where they are used, so that photos need not fit into memory.

A file has no name: nothing is left of it when the process ends, however it does. Its arrays are read-only maps of it.
What of them was read stays in memory until it is released (`release_pages`) or the system needs the room.
"""

import mmap
import tempfile
import weakref
from pathlib import Path

import numpy as np
from numpy import ndarray as Array

SEGMENT = 1 << 30  # bytes of a file; a larger array has one of its own


class ArrayFile:
    """Stores arrays in unnamed files of a folder, which is made when the first one is stored.

    The room of an array that nothing refers to any more is used again.
    """

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        self._segments: list[_Segment] = []
        self._free: dict[int, list[tuple[_Segment, int]]] = {}  # by size

    def store(self, array: Array) -> Array:
        """The array's bytes on disk, as a read-only array. Raises: OSError: the disk is full."""
        array = np.ascontiguousarray(array)
        if not array.nbytes:
            return array
        room = -(-array.nbytes // mmap.ALLOCATIONGRANULARITY) * mmap.ALLOCATIONGRANULARITY
        segment, offset = self._find_room(room)
        segment.file.seek(offset)
        segment.file.write(array.reshape(-1).view(np.uint8).data)
        segment.file.flush()
        root = np.frombuffer(segment.map, array.dtype, array.size, offset)  # what all views of it refer to
        weakref.finalize(root, self._free.setdefault(room, []).append, (segment, offset))
        return root.reshape(array.shape)

    def _find_room(self, room: int) -> tuple["_Segment", int]:
        if self._free.get(room):
            return self._free[room].pop()
        if not self._segments or self._segments[-1].end + room > self._segments[-1].size:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._segments.append(_Segment(self.folder, max(room, SEGMENT)))
        segment = self._segments[-1]
        segment.end += room
        return segment, segment.end - room


class _Segment:
    """A file and the map of it. end: bytes in use."""

    def __init__(self, folder: Path, size: int):
        self.file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115  it lives as long as its arrays
        self.file.truncate(size)  # takes no room before it is written
        self.map = mmap.mmap(self.file.fileno(), size, access=mmap.ACCESS_READ)
        self.size, self.end = size, 0


def release_pages(array: Array) -> None:
    """Give back the memory that reading an array of an ArrayFile took, until it is read again; nothing for others."""
    while isinstance(array.base, Array):
        array = array.base
    file_map = array.base.obj if isinstance(array.base, memoryview) else array.base
    if isinstance(file_map, mmap.mmap):
        start = _address(array) - _address(np.frombuffer(file_map, np.uint8, 1))
        whole = -(-array.nbytes // mmap.PAGESIZE) * mmap.PAGESIZE
        file_map.madvise(mmap.MADV_DONTNEED, start, whole)


def _address(array: Array) -> int:
    return array.__array_interface__["data"][0]
