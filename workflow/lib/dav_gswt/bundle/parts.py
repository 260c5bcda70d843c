"""Parts: the files of a bundle, in the order in which a viewer fetches them.

Each is a zlib stream; the manifest has its size, digest and the size that it inflates to. A set of kind `plain` is not
compressed.
"""

import hashlib
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from dav_gswt.bundle.encoding import Entry, Natural
from dav_gswt.errors import InputError

FOLDER = "parts"
LEVEL, RECIPES, RECORDS, PLAIN = "level", "recipes", "records", "plain"  # kinds
MAX_SIZE = 1 << 29  # bytes that all parts may inflate to
MAX_COUNT, MAX_TOTAL = 1 << 24, 1 << 26  # Gaussians of a tile at a level, and of all
EFFORT = 9  # of zlib; its strategy for noise saves 4 %


@dataclass(frozen=True)
class PartEntry(Entry):
    """A file in the manifest: what it holds, its path relative to the manifest, bytes of the file, bytes that it
    inflates to, digest of the file. level: that a part of kind `level` holds.
    """

    kind: Annotated[str, Field(min_length=1, max_length=40)]
    file: Annotated[str, Field(pattern=r"^parts/[A-Za-z0-9_]+\.bin$")]
    bytes: Annotated[int, Field(ge=1, le=MAX_SIZE)]
    size: Annotated[int, Field(ge=1, le=MAX_SIZE)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    level: Natural | None = None


@dataclass(frozen=True)
class ChunkEntry(Entry):
    """A tile or an object at a level: its number of Gaussians. part, first: where its records are stored, the index of
    the part and the number of the first record in it; without them the tile is composed.
    """

    level: Natural
    count: Annotated[int, Field(ge=1, le=MAX_COUNT)]
    part: Natural | None = None
    first: Natural | None = None


def write_part(data: bytes, folder: Path, kind: str, name: str, level: int | None = None) -> PartEntry:
    """Compress data to parts/{name}.bin in a bundle's folder; returns its entry in the manifest."""
    stream, file = zlib.compressobj(EFFORT, strategy=zlib.Z_FILTERED), f"{FOLDER}/{name}.bin"
    packed = stream.compress(data) + stream.flush()
    (folder / file).write_bytes(packed)
    return PartEntry(kind, file, len(packed), len(data), hashlib.sha256(packed).hexdigest(), level)


def read_part(folder: Path | str, entry: PartEntry) -> bytes:
    """The inflated bytes of a part. Raises: InputError: see `read_exactly`; it does not inflate to its size."""
    data = read_exactly(folder, entry.file, entry.bytes, entry.sha256)
    if entry.kind == PLAIN:
        return data
    stream = zlib.decompressobj()
    try:
        found = stream.decompress(data, entry.size + 1)
    except zlib.error as error:
        raise InputError(f"{Path(folder) / entry.file}: not readable ({error}); make the bundle again") from None
    if len(found) != entry.size or not stream.eof or stream.unused_data:
        raise InputError(f"{Path(folder) / entry.file}: does not hold {entry.size} bytes; make the bundle again")
    return found


def read_exactly(folder: Path | str, name: str, size: int, sha256: str) -> bytes:
    """The bytes of a file of a bundle or a page.

    Raises: InputError: the file lies outside of the folder, is missing, has another size (checked before anything is
    read) or another digest.
    """
    path = Path(folder) / name
    try:
        if not path.resolve().is_relative_to(Path(folder).resolve()):
            raise InputError(f"{path}: lies outside of the folder; make the bundle again")
        if (found := path.stat().st_size) != size:
            raise InputError(f"{path}: {found} bytes where the manifest says {size}; make the bundle again")
        data = path.read_bytes()
    except (OSError, RuntimeError) as error:  # of a link to itself the latter
        raise InputError(f"{path}: not readable ({getattr(error, 'strerror', error)}); make the bundle again") from None
    if hashlib.sha256(data).hexdigest() != sha256:
        raise InputError(f"{path}: its digest is not the manifest's; make the bundle again")
    return data
