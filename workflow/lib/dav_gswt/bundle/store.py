"""A bundle on disk: the manifest is read and checked first, parts when they are needed, each once."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray as Array

from dav_gswt.bundle import recipes
from dav_gswt.bundle.encoding import RECORD
from dav_gswt.bundle.manifest import Manifest, read_manifest
from dav_gswt.bundle.parts import LEVEL, PLAIN, PLANES, RECIPES, ChunkEntry, read_part, unpack_block
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.logs import progress


@dataclass(frozen=True)
class Bundle:
    """A folder and its manifest. No part is read until it is needed."""

    folder: Path
    manifest: Manifest
    _parts: dict[int, Any] = field(default_factory=dict)

    def chunk(self, tile: int, level: int) -> GaussianField:
        """A tile's Gaussians at a level. Raises: InputError: see `parts.read_part` and `recipes.unpack_recipes`."""
        entry, ground = self.manifest.tiles[tile].chunks[level], None
        if entry.part is None:
            rows, ground = self.compose_tile(tile, level)
        else:
            rows = self._read_records(entry)
        decoded = self.manifest.encoding.decode(rows)
        return decoded if ground is None else replace(decoded, ground=ground)

    def object_chunk(self, number: int, level: int) -> GaussianField:
        """An object's Gaussians at a level, about its foot. Raises: as `chunk`."""
        decoded = self.manifest.encoding.decode(self._read_records((self.manifest.objects or [])[number].chunks[level]))
        middle = np.array([0.5 * self.manifest.tile_side, 0.5 * self.manifest.tile_side, 0])
        return replace(decoded, means=(decoded.means - middle).astype(np.float32))

    def fields(self) -> list[list[GaussianField]]:
        """fields[level][tile] of the whole set."""
        levels, tiles = range(len(self.manifest.levels)), range(len(self.manifest.tiles))
        return [[self.chunk(t, level) for t in tiles] for level in progress(levels, "read levels")]

    def compose_tile(self, tile: int, level: int) -> tuple[Array, Array]:
        """The records of a composed tile, and which of them are ground. Raises: as `chunk`."""
        manifest, composed = self.manifest, self.manifest.composition
        assert composed is not None
        each = len(manifest.tiles) // len(manifest.materials)
        layers = self._read(self._find_part(LEVEL, level))[tile // each]
        recipe = self._read(self._find_part(RECIPES))[tile][level]
        found, count = recipes.count_records(layers, recipe), manifest.tiles[tile].chunks[level].count
        if found != count:
            name = self.folder / manifest.parts[self._find_part(LEVEL, level)].file
            raise InputError(f"{name}: tile {tile} has {found} splats, not {count}; make the bundle again")
        return recipes.compose_records(layers, recipe, recipes.locate_corner(manifest.encoding), composed.cell << level)

    def _find_part(self, kind: str, level: int | None = None) -> int:
        parts = self.manifest.parts
        return next(k for k, part in enumerate(parts) if part.kind == kind and part.level in (level, None))

    def _read_records(self, entry: ChunkEntry) -> Array:
        assert entry.part is not None and entry.first is not None
        return self._read(entry.part)[entry.first : entry.first + entry.count]

    def _read(self, number: int) -> Any:
        """What a part holds; it is read once."""
        if number not in self._parts:
            manifest, part = self.manifest, self.manifest.parts[number]
            data, name = read_part(self.folder, part), f"{self.folder / part.file}"
            if part.kind == LEVEL:
                assert manifest.composition is not None and part.level is not None
                self._parts[number] = recipes.unpack_level(data, manifest.composition, part.level, name)
            elif part.kind == RECIPES:
                assert manifest.composition is not None
                tiles = len(manifest.tiles)
                self._parts[number] = recipes.unpack_recipes(data, manifest.composition, tiles, name)
            elif len(data) % (RECORD.itemsize if part.kind == PLAIN else PLANES):
                raise InputError(f"{name}: does not hold whole splats; make the bundle again")
            elif part.kind == PLAIN:
                self._parts[number] = np.frombuffer(data, RECORD)
            else:
                self._parts[number] = unpack_block(data).to_records()
        return self._parts[number]


def read_bundle(folder: Path | str) -> Bundle:
    """Open a bundle. Raises: InputError: see `manifest.read_manifest`."""
    return Bundle(Path(folder), read_manifest(folder))
