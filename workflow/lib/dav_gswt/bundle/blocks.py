"""Blocks: Gaussians as the files of a bundle store them, 19 planes of one byte each, which compress well.

A block of n Gaussians is, plane after plane of n bytes,

    x, y, z                   two planes each: low bytes, high bytes
    scale, rotation           three planes each, as in a record (`encoding.RECORD`)
    green, red - green, blue - green    two planes each
    opacity                   one plane

z is stored as the difference to the previous Gaussian's (the first: to 0). All differences are modulo 65536, as signed
numbers in zigzag: 0, -1, 1, -2, ... are 0, 1, 2, 3, ... Colours are signed steps of 1/255: an exemplar's may lie beyond
0 and 255, where a tile's correction brings them back.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16, UInt8, UInt16
from numpy import ndarray as Array

from dav_gswt.bundle.encoding import RECORD

PLANES = 19  # bytes of a Gaussian


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
