"""A bundle on disk, read back with checks: the manifest first, then chunk by chunk."""

from dataclasses import dataclass
from pathlib import Path

from jaxtyping import Integer
from numpy import ndarray as Array

from dav_gswt.bundle import chunks, manifest
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.field import GaussianField
from dav_gswt.logs import progress


@dataclass(frozen=True)
class Bundle:
    """A folder and its manifest. Nothing of the chunks is read until it is asked for."""

    folder: Path
    manifest: dict

    @property
    def encoding(self) -> Encoding:
        return Encoding.from_dict(self.manifest["encoding"])

    def chunk(self, tile: int, level: int) -> tuple[GaussianField, Integer[Array, "d n"]]:
        """A tile's Gaussians at a level, and their orders. Raises: InputError: see `chunks.read`."""
        return chunks.read_chunk(self.folder, self.manifest["tiles"][tile]["chunks"][level], self.encoding)

    def fields(self) -> list[list[GaussianField]]:
        """fields[level][tile] of the whole set."""
        levels, tiles = range(len(self.manifest["levels"])), range(len(self.manifest["tiles"]))
        return [[self.chunk(t, level)[0] for t in tiles] for level in progress(levels, "read levels")]


def read_bundle(folder: Path | str, schema: Path | str) -> Bundle:
    """A bundle whose manifest is sound. Raises: InputError: see `manifest.read`."""
    return Bundle(Path(folder), manifest.read_manifest(folder, schema))
