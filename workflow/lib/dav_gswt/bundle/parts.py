"""Parts: the files of a bundle, in the order in which a viewer fetches them.

Each is a zlib stream; the manifest has its size, digest and the size that it inflates to. A set of kind `plain` is not
compressed.

The Gaussians in them are blocks: 19 planes of one byte each, which compress well. A block of n Gaussians is, plane
after plane of n bytes,

    x, y, z                   two planes each: low bytes, high bytes
    scale, rotation           three planes each, as in a record (`encoding.RECORD`)
    green, red - green, blue - green    two planes each
    opacity                   one plane

z is stored as the difference to the previous Gaussian's (the first: to 0). All differences are modulo 65536, as signed
numbers in zigzag: 0, -1, 1, -2, ... are 0, 1, 2, 3, ... Colours are signed steps of 1/255: an exemplar's may lie beyond
0 and 255, where a tile's correction brings them back.
"""

import hashlib
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Int16, UInt8, UInt16
from numpy import ndarray as Array
from pydantic import Field

from dav_gswt.bundle.encoding import RECORD, Entry, Natural
from dav_gswt.errors import InputError

FOLDER = "parts"
LEVEL, RECIPES, RECORDS, PLAIN = "level", "recipes", "records", "plain"  # kinds
MAX_SIZE = 1 << 29  # bytes that all parts may inflate to
MAX_COUNT, MAX_TOTAL = 1 << 24, 1 << 26  # Gaussians of a tile at a level, and of all
# of zlib, for planes of noise: 0.4 to 1.4 % smaller in 0.6 of the time of effort 9 with its usual memory
EFFORT, MEMORY = 8, 6
PLANES = 19  # bytes of a Gaussian


@dataclass(frozen=True)
class PartEntry(Entry):
    """A file of the bundle.

    Attributes:
        kind: what the file contains. A reader may skip parts of unknown kinds.
        file: path relative to the manifest.
        bytes: size of the file.
        size: number of bytes after decompression.
        sha256: digest of the file.
        level: level of the exemplars in the file; only for parts of kind `level`.
    """

    kind: Annotated[str, Field(min_length=1, max_length=40)]
    file: Annotated[str, Field(pattern=r"^parts/[A-Za-z0-9_]+\.bin$")]
    bytes: Annotated[int, Field(ge=1, le=MAX_SIZE)]
    size: Annotated[int, Field(ge=1, le=MAX_SIZE)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    level: Natural | None = None


@dataclass(frozen=True)
class ChunkEntry(Entry):
    """One tile or one object at one level. Without `part` and `first`, the tile is composed.

    Attributes:
        level: index into `levels`.
        count: number of Gaussians.
        part: index into `parts` of the part in which its records are stored.
        first: number of its first record in that part.
    """

    level: Natural
    count: Annotated[int, Field(ge=1, le=MAX_COUNT)]
    part: Natural | None = None
    first: Natural | None = None


def write_part(data: bytes, folder: Path, kind: str, name: str, level: int | None = None) -> PartEntry:
    """Compress data to parts/{name}.bin in a bundle's folder; returns its entry in the manifest."""
    stream, file = zlib.compressobj(EFFORT, memLevel=MEMORY, strategy=zlib.Z_FILTERED), f"{FOLDER}/{name}.bin"
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


@dataclass(frozen=True)
class Block:
    """Gaussians in whole numbers: position in steps, colours in steps of 1/255."""

    position: UInt16[Array, "n 3"]
    scale: UInt8[Array, "n 3"]
    rotation: UInt8[Array, "n 3"]
    colours: Int16[Array, "n 3"]
    opacity: UInt8[Array, "n"]

    def __len__(self) -> int:
        return len(self.opacity)

    def __getitem__(self, rows) -> "Block":
        return Block(*(values[rows] for values in vars(self).values()))

    @classmethod
    def from_records(cls, rows: Array) -> "Block":
        """The Gaussians of records."""
        colours = rows["rgba"][:, :3].astype(np.int16)
        return cls(rows["position"], rows["scale"], rows["rotation"], colours, rows["rgba"][:, 3])

    def to_records(self) -> Array:
        """The records of Gaussians, with colours clipped."""
        rows = np.empty(len(self), RECORD)
        rows["position"], rows["scale"], rows["rotation"] = self.position, self.scale, self.rotation
        rows["rgba"][:, :3], rows["rgba"][:, 3] = np.clip(self.colours, 0, 255), self.opacity
        return rows


def pack_block(block: Block) -> bytes:
    """The planes of a block."""
    x, y, z = block.position.T.astype(np.uint16)
    red, green, blue = block.colours.T.astype(np.uint16)
    words = [x, y, pack_differences(z), green, zigzag(red - green), zigzag(blue - green)]
    wide = [split_bytes(word) for word in words]
    narrow = [np.ascontiguousarray(values.T).tobytes() for values in (block.scale, block.rotation)]
    return b"".join([*wide[:3], *narrow, *wide[3:], block.opacity.tobytes()])


def unpack_block(data: bytes) -> Block:
    """The Gaussians of a block's planes, of which there must be whole ones."""
    planes = np.frombuffer(data, np.uint8).reshape(PLANES, -1)
    x, y, z = (join_bytes(planes[k : k + 2]) for k in (0, 2, 4))
    green, red, blue = (join_bytes(planes[k : k + 2]) for k in (12, 14, 16))
    position = np.stack([x, y, unpack_differences(z)], 1)
    colours = np.stack([unzigzag(red) + green, green, unzigzag(blue) + green], 1).view(np.int16)
    return Block(position, planes[6:9].T, planes[9:12].T, colours, planes[18])


def zigzag(values: UInt16[Array, "n"]) -> UInt16[Array, "n"]:
    """Signed numbers, modulo 65536, as small numbers where they are near 0."""
    return (values << 1) ^ (values.view(np.int16) >> 15).view(np.uint16)


def unzigzag(values: UInt16[Array, "n"]) -> UInt16[Array, "n"]:
    """The inverse of zigzag."""
    return (values >> 1) ^ (-(values & 1).astype(np.int16)).view(np.uint16)


def pack_differences(values: UInt16[Array, "n"]) -> UInt16[Array, "n"]:
    """Differences to the previous value (the first: to 0), in zigzag."""
    return zigzag(np.diff(values, prepend=np.uint16(0)))


def unpack_differences(values: UInt16[Array, "n"]) -> UInt16[Array, "n"]:
    """The inverse of pack_differences."""
    return np.cumsum(unzigzag(values), dtype=np.uint16)


def split_bytes(values: UInt16[Array, "..."]) -> bytes:
    """The low bytes of all values, then the high ones."""
    return (values & 255).astype(np.uint8).tobytes() + (values >> 8).astype(np.uint8).tobytes()


def join_bytes(planes: UInt8[Array, "2 n"]) -> UInt16[Array, "n"]:
    """Values of their low and high bytes."""
    return planes[0] | planes[1].astype(np.uint16) << 8
