"""A bundle on disk: the manifest is read and checked first, chunks when they are asked for."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Integer
from numpy import ndarray as Array

from dav_gswt.bundle import chunks
from dav_gswt.bundle.manifest import Manifest, read_manifest
from dav_gswt.field import GaussianField
from dav_gswt.logs import progress


@dataclass(frozen=True)
class Bundle:
    """A folder and its manifest. No chunk is read until it is asked for."""

    folder: Path
    manifest: Manifest

    def chunk(self, tile: int, level: int) -> tuple[GaussianField, Integer[Array, "d n"]]:
        """A tile's Gaussians at a level, and their orders. Raises: InputError: see `chunks.read_chunk`."""
        return chunks.read_chunk(self.folder, self.manifest.tiles[tile].chunks[level], self.manifest.encoding)

    def object_chunk(self, number: int, level: int) -> tuple[GaussianField, Integer[Array, "d n"]]:
        """An object's Gaussians at a level, about its foot, and their orders. Raises: as `chunk`."""
        entry = (self.manifest.objects or [])[number].chunks[level]
        field, orders = chunks.read_chunk(self.folder, entry, self.manifest.encoding)
        middle = np.array([0.5 * self.manifest.tile_side, 0.5 * self.manifest.tile_side, 0])
        return replace(field, means=(field.means - middle).astype(np.float32)), orders

    def fields(self) -> list[list[GaussianField]]:
        """fields[level][tile] of the whole set."""
        levels, tiles = range(len(self.manifest.levels)), range(len(self.manifest.tiles))
        return [[self.chunk(t, level)[0] for t in tiles] for level in progress(levels, "read levels")]


def read_bundle(folder: Path | str) -> Bundle:
    """Open a bundle. Raises: InputError: see `manifest.read_manifest`."""
    return Bundle(Path(folder), read_manifest(folder))
