"""Recipes: what the tiles of a bundle are composed of, in whole numbers, so that every reader makes equal bytes.

A bundle stores the exemplar's Gaussians once, by cell, and for each tile and level which cell of the exemplar each of
its cells shows, and by how much that changes in height and colour there. docs/formats.md specifies both to the byte.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Bool, Int, Int16, UInt8
from numpy import ndarray as Array
from pydantic import Field

from dav_gswt.bundle.encoding import POSITION_STEPS, ROTATION_STEPS, Encoding, Entry
from dav_gswt.bundle.parts import (
    PLANES,
    Block,
    join_bytes,
    pack_block,
    pack_differences,
    split_bytes,
    unpack_block,
    unpack_differences,
)
from dav_gswt.errors import InputError
from dav_gswt.tiles.build import Recipe, TileSet
from dav_gswt.tiles.compose import BinnedLevel, coarsen_labels, find_underlay
from dav_gswt.tiles.layout import LABELS, source_cells

MAX_CELLS = 4096  # along a tile or an exemplar
CHANNELS = 4  # of a correction: z, green, red, blue
SHIFTS = 2 * len(LABELS)  # numbers, of two bytes each
GROUND, UNDERLAY, REST = range(3)  # layers of a level


@dataclass(frozen=True)
class Composition(Entry):
    """What composed tiles have in common. Finest cells are ground cells of level 0.

    Attributes:
        side: number of finest cells along a tile's side, a multiple of 2^(levels - 1).
        cell: width of a finest cell in steps of the encoding.
        levels: number of composed levels, from the finest one. The coarser levels are stored.
        exemplars: for each material, number of finest cells along the side of its exemplar.
    """

    side: Annotated[int, Field(ge=1, le=MAX_CELLS)]
    cell: Annotated[int, Field(ge=1, le=POSITION_STEPS)]
    levels: Annotated[int, Field(ge=1, le=16)]
    exemplars: Annotated[list[Annotated[int, Field(ge=1, le=MAX_CELLS)]], Field(min_length=1, max_length=8)]

    def recipes_size(self, tiles: int) -> int:
        """Bytes of the recipes of so many tiles."""
        return tiles * (2 * SHIFTS + self.side**2 * (1 + 2 * CHANNELS))


@dataclass(frozen=True)
class Layer:
    """Gaussians by cell: cell k holds start[k]:start[k + 1]. x and y count from the cell's south-western corner."""

    start: Int[Array, "k"]
    block: Block


@dataclass(frozen=True)
class TileRecipe:
    """A tile at a level: the exemplar's cell that each of its cells shows, and the correction there."""

    cells: Int[Array, "k k"]
    correction: Int16[Array, "4 k k"]


def pack_level(sets: Sequence[TileSet], recipes: Sequence[Recipe], level: int, encoding: Encoding, steps: int) -> bytes:
    """The part of a composed level. steps: of position along a finest cell."""
    found = []
    for tiles, recipe in zip(sets, recipes, strict=True):
        binned = recipe.levels[level]
        under = find_underlay(binned.field, binned.cell * binned.exemplar.spacing)
        layers = np.where(binned.field.ground, GROUND, np.where(under, UNDERLAY, REST))
        used = find_used_cells(tiles, binned)[binned.numbers]
        for layer in (GROUND, UNDERLAY, REST):
            mine = np.flatnonzero((layers == layer) & used)
            cells, field = binned.numbers[mine], binned.field[mine]
            width = binned.cell * steps
            place = (field.means[:, :2].astype(float) - [binned.exemplar.west, binned.exemplar.south]) / encoding.step[
                0
            ]
            place -= width * np.stack([cells % binned.cells, cells // binned.cells], 1)
            block = Block.from_records(encoding.encode(field))
            position = np.concatenate([np.rint(np.clip(place, 0, width)), block.position[:, 2:]], 1).astype(np.uint16)
            colours = np.rint(255 * field.base_colours.astype(float)).clip(-(1 << 15), (1 << 15) - 1).astype(np.int16)
            counts = np.bincount(cells, minlength=binned.cells**2)
            if counts.max(initial=0) > POSITION_STEPS:
                raise InputError("tiles: more than 65535 splats in one cell of the ground; use a finer preset")
            block = Block(position, block.scale, coarsen_rotation(block.rotation), colours, block.opacity)
            found += [split_bytes(counts.astype(np.uint16)), pack_block(block)]
    return b"".join(found)


def coarsen_rotation(rotation: UInt8[Array, "n 3"]) -> UInt8[Array, "n 3"]:
    """Every second step of a rotation: half a degree, which no picture shows."""
    steps = np.rint((rotation.astype(float) - ROTATION_STEPS) / 2) * 2
    return (ROTATION_STEPS + np.clip(steps, 1 - ROTATION_STEPS, ROTATION_STEPS - 1)).astype(np.uint8)


def find_used_cells(tiles: TileSet, level: BinnedLevel) -> Bool[Array, "k"]:
    """Which of the exemplar's cells any tile shows."""
    used = np.zeros(level.cells**2, bool)
    for labels, shift in zip(tiles.labels, tiles.shifts, strict=True):
        rows, columns = source_cells(coarsen_labels(labels, level.cell), shift, level.cell)
        used[rows * level.cells + columns] = True
    return used


def unpack_level(data: bytes, composition: Composition, level: int, name: str) -> list[list[Layer]]:
    """[material][layer] of a part of pack_level. Raises: InputError: it is shorter or longer than it says."""
    found, at = [], 0
    for cells in composition.exemplars:
        layers, many = [], (cells >> level) ** 2
        for _ in (GROUND, UNDERLAY, REST):
            counts = np.frombuffer(data, np.uint8, offset=at)[: 2 * many]
            if len(counts) < 2 * many:
                raise InputError(f"{name}: ends too early; make the bundle again")
            start = np.concatenate([[0], np.cumsum(join_bytes(counts.reshape(2, many)), dtype=np.int64)])
            at += 2 * many
            if at + PLANES * start[-1] > len(data):
                raise InputError(f"{name}: ends too early; make the bundle again")
            block = unpack_block(data[at : at + PLANES * int(start[-1])])
            if len(block) and block.position[:, :2].max() > composition.cell << level:
                raise InputError(f"{name}: a splat lies outside of its cell; make the bundle again")
            layers.append(Layer(start, block))
            at += PLANES * int(start[-1])
        found.append(layers)
    if at != len(data):
        raise InputError(f"{name}: goes on after its end; make the bundle again")
    return found


def pack_recipes(sets: Sequence[TileSet], recipes: Sequence[Recipe], encoding: Encoding) -> bytes:
    """The part of all tiles' recipes."""
    found = []
    for tiles, recipe in zip(sets, recipes, strict=True):
        for number, (labels, shift) in enumerate(zip(tiles.labels, tiles.shifts, strict=True)):
            found += [shift.astype("<i2").tobytes(), labels.tobytes()]
            for channel in quantize_correction(recipe.corrections[number], encoding):
                found.append(split_bytes(pack_differences(channel.ravel().astype(np.uint16))))
    return b"".join(found)


def quantize_correction(correction: Array, encoding: Encoding) -> Int[Array, "4 k k"]:
    """A correction (red, green, blue, height) as z, green, red and blue in steps of records."""
    red, green, blue, height = np.moveaxis(correction.astype(float), -1, 0)
    steps = np.stack([height / (encoding.step[2] or 1), 255 * green, 255 * red, 255 * blue])
    return np.rint(steps).clip(-(1 << 15), (1 << 15) - 1).astype(int)


def unpack_recipes(data: bytes, composition: Composition, tiles: int, name: str) -> list[list[TileRecipe]]:
    """[tile][level] of a part of pack_recipes, of all materials' tiles; each cell lies inside its exemplar.

    Raises: InputError: another size, an unknown label, or a cell outside of the exemplar.
    """
    if len(data) != composition.recipes_size(tiles):
        raise InputError(f"{name}: {len(data)} bytes are not the recipes of {tiles} tiles; make the bundle again")
    found, at, each, k = [], 0, tiles // len(composition.exemplars), composition.side
    for tile in range(tiles):
        shift = np.frombuffer(data, "<i2", SHIFTS, at).reshape(-1, 2).astype(int)
        labels = np.frombuffer(data, np.uint8, k * k, at + 2 * SHIFTS).reshape(k, k)
        planes = np.frombuffer(data, np.uint8, 2 * CHANNELS * k * k, at + 2 * SHIFTS + k * k)
        at += 2 * SHIFTS + (1 + 2 * CHANNELS) * k * k
        if labels.max() >= len(LABELS):
            raise InputError(f"{name}: tile {tile} has an unknown label; make the bundle again")
        values = [unpack_differences(join_bytes(channel)) for channel in planes.reshape(CHANNELS, 2, k * k)]
        correction, levels = np.stack(values).view(np.int16).reshape(CHANNELS, k, k), []
        for level in range(composition.levels):
            majority, cells = coarsen_labels(labels, 1 << level), composition.exemplars[tile // each] >> level
            rows, columns = source_cells(majority, shift, 1 << level)
            if (shift[np.unique(majority)] % (1 << level)).any():
                raise InputError(f"{name}: tile {tile} is shifted by part of a cell; make the bundle again")
            if min(rows.min(), columns.min()) < 0 or max(rows.max(), columns.max()) >= cells:
                raise InputError(f"{name}: tile {tile} shows ground beyond its exemplar; make the bundle again")
            levels.append(TileRecipe(rows * cells + columns, coarsen_correction(correction, labels, majority)))
        found.append(levels)
    return found


def coarsen_correction(
    correction: Int16[Array, "4 n n"], labels: UInt8[Array, "n n"], coarse: UInt8[Array, "k k"]
) -> Int16[Array, "4 k k"]:
    """The correction on a coarser grid: its mean over the finest cells that carry the coarse cell's label, rounded."""
    k, f = len(coarse), len(labels) // len(coarse)
    same = labels.reshape(k, f, k, f) == coarse[:, None, :, None]
    total = (correction.astype(int).reshape(CHANNELS, k, f, k, f) * same).sum((2, 4))
    many = same.sum((1, 3))
    return ((2 * total + many) // (2 * many)).astype(np.int16)


def locate_corner(encoding: Encoding) -> tuple[int, int]:
    """Steps from the grid's origin to a tile's south-western corner, along x and y."""
    x, y = (round(-at / (step or 1)) for at, step in zip(encoding.origin[:2], encoding.step[:2], strict=True))
    return x, y


def count_records(layers: Sequence[Layer], recipe: TileRecipe) -> int:
    """How many records a tile has at a level: more than memory holds can be written in a few bytes."""
    return sum(int(np.diff(layer.start)[recipe.cells].sum()) for layer in layers)


def compose_records(
    layers: Sequence[Layer], recipe: TileRecipe, corner: tuple[int, int], width: int
) -> tuple[Array, Bool[Array, "n"]]:
    """The records of a tile at a level, and which of them are ground.

    Args: corner: steps from the grid's origin to the tile's south-western corner. width: steps along a cell.
    """
    k = len(recipe.cells)
    place = np.stack(np.meshgrid(np.arange(k), np.arange(k)), -1).reshape(-1, 2) * width + corner
    parts = []
    for layer in layers:
        first, count = layer.start[recipe.cells.ravel()], np.diff(layer.start)[recipe.cells.ravel()]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        block, cell = layer.block[np.repeat(first, count) + within], np.repeat(np.arange(k * k), count)
        height, green, red, blue = (channel.ravel()[cell].astype(int) for channel in recipe.correction)
        position = block.position.astype(int)
        position[:, :2] += place[cell]
        position[:, 2] += height
        colours = block.colours.astype(int) + np.stack([red, green, blue], 1)
        clipped = np.clip(position, 0, POSITION_STEPS).astype(np.uint16)
        parts.append(
            Block(clipped, block.scale, block.rotation, np.clip(colours, 0, 255).astype(np.int16), block.opacity)
        )
    ground = np.repeat(np.arange(len(parts)) == GROUND, [len(part) for part in parts])
    return np.concatenate([part.to_records() for part in parts]), ground
