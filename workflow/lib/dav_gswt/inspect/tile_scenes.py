"""Scenes of tile sets: sixteen tiles arranged so that neighbours match, with their cuts; a bundle has no cuts."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Integer
from numpy import ndarray as Array

from dav_gswt.bundle import store as bundles
from dav_gswt.errors import InputError
from dav_gswt.export.splats import TILES_PER_ROW
from dav_gswt.field import GaussianField
from dav_gswt.inspect import result_files
from dav_gswt.inspect.field_scenes import (
    COLOUR_NAMES,
    LEVEL_COLOURS,
    compute_colours,
    make_legend,
    make_solids,
    shade_colours,
    thin_field,
)
from dav_gswt.inspect.options import ViewOptions
from dav_gswt.inspect.scene import ColourBar, ColourKey, Label, Layer, Scene, move_layer
from dav_gswt.tiles import store
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import EDGES, LABELS, arrange_torus

GAP, LETTER = 0.2, 0.1  # tile sides
CUT_WIDTH, MIN_CUT_WIDTH = 0.35, 0.012  # of a cut: in finest cells, and at least in tile sides
CUT_LIFT = 0.6  # of a cut above the ground, in cells of its level
CUT_COLOUR = (255, 214, 10)
PATCH_COLOURS = [(187, 187, 187), *LEVEL_COLOURS[:4], (102, 204, 238), (170, 51, 119), (153, 102, 51), (0, 0, 0)]


def build_tiles(path: Path, options: ViewOptions) -> Scene:
    """A folder of tiles, or its seams.json."""
    seams = path / "seams.json"
    with result_files.wrap_errors(seams):
        tiles = store.read_tiles(path / "tiles", seams)
        _check_labels(tiles, seams)
    return arrange_tiles(str(path), tiles.fields, tiles.side, tiles, options)


def build_bundle(path: Path, options: ViewOptions) -> Scene:
    """A bundle's folder: the quantized tiles, without cuts."""
    bundle = bundles.read_bundle(path)
    with result_files.wrap_errors(path / "davgswt.json"):
        side = bundle.manifest.tile_side
    return arrange_tiles(str(path), bundle.fields(), side, None, options)


def _check_labels(tiles: TileSet, seams: Path) -> None:
    labels = tiles.labels
    fits = labels.ndim == 3 and labels.shape[1] == labels.shape[2] and labels.dtype.kind in "ui"
    if not fits or len(labels) % EDGES or labels.max(initial=0) >= len(LABELS):
        raise InputError(f"{seams}: labels.npz is not a map of each of its tiles; cut them again")
    if not (0 < tiles.side < np.inf and abs(labels.shape[1] * tiles.spacing - tiles.side) < 1e-6 * tiles.side):
        raise InputError(f"{seams}: its tiles are {tiles.side} wide and their maps are not; cut them again")


def arrange_tiles(
    title: str, fields: list[list[GaussianField]], side: float, cut: TileSet | None, options: ViewOptions
) -> Scene:
    """All tiles of a level, or, coloured by `level`, all levels in a row, the finest in the west.

    cut: the tile set whose cuts are drawn; None: no cuts.
    """
    by = options.choose_colour((*COLOUR_NAMES, "patch") if cut else COLOUR_NAMES, title)
    numbers = options.choose_levels(len(fields), Path(title))
    if options.level is None and by != "level":
        numbers = numbers[:1]
    step, tall = side * (1 + GAP), TILES_PER_ROW * side * (1 + GAP)
    wide = tall * (len(fields[0]) // EDGES)
    layers, labels = [], []
    for place, number in enumerate(numbers):
        for tile, corner in place_tiles(len(fields[0]), step):
            corner = corner + [place * (wide + 2 * GAP * side), 0.0, 0.0]
            field = thin_field(fields[number][tile], options.most // len(fields[0]) // len(numbers))
            layers += [move_layer(layer, corner) for layer in _make_tile_layers(field, by, number, tile, cut)]
            if cut and by != "patch":
                layers.append(move_layer(make_cuts(cut, tile, number), corner))
            if place == 0:
                middle = float(np.median(field.means[:, 2])) if len(field) else 0.0
                at = corner + [0.5 * side, -0.6 * GAP * side, middle]
                labels.append(Label(f"{tile}", tuple(at), LETTER * side, upright=False))
    low = np.array([0.0, -GAP * side, 0.0])
    high = np.array([wide + (len(numbers) - 1) * (wide + 2 * GAP * side), tall - GAP * side, 0.2 * side])
    about = f"{len(fields[0])} tiles, {len(fields)} levels, {side:.4g} wide; by {by}"
    shown = "levels " + ", ".join(map(str, numbers)) if len(numbers) > 1 else f"level {numbers[0]}"
    return Scene(title, layers, low, high, [about, shown], labels, _make_legend(by, numbers, cut), (-0.25, -1.0, 1.3))


def place_tiles(count: int, step: float) -> list[tuple[int, Float[Array, "3"]]]:
    """Tiles and their south-western corners: each variant's sixteen four by four, neighbours' edges of one colour."""
    return [
        (int(tile), np.array([(TILES_PER_ROW * variant + column) * step, row * step, 0.0]))
        for variant in range(count // EDGES)
        for (row, column), tile in np.ndenumerate(arrange_torus(variant)[1:-1, 1:-1])
    ]


def _make_tile_layers(field: GaussianField, by: str, level: int, tile: int, cut: TileSet | None) -> list[Layer]:
    if not len(field):
        return []
    if by != "patch" or cut is None:
        return make_solids(field, compute_colours(field, by, level))
    patches = np.array(PATCH_COLOURS)[find_patches(field, cut, tile)]
    return make_solids(field, shade_colours(patches, field))


def find_patches(field: GaussianField, cut: TileSet, tile: int) -> Integer[Array, "n"]:
    """The label of the cell that each Gaussian lies over; of the nearest one, beyond the tile."""
    last = cut.labels.shape[1] - 1
    column, row = np.clip(field.means[:, :2] / cut.spacing, 0, last).astype(int).T
    return cut.labels[tile][row, column]


def make_cuts(cut: TileSet, tile: int, level: int) -> Layer:
    """Where a tile's labels change, as ribbons a little above the highest ground of the two cells that part there.

    Ribbons, not lines: browsers draw lines one pixel wide.
    """
    labels, spacing = cut.labels[tile], cut.spacing
    height = compute_heights(cut.fields[level][tile], len(labels), spacing)
    rows, columns = np.nonzero(labels[:, 1:] != labels[:, :-1])  # a border that runs north
    upright = np.stack([columns + 1.0, rows + 0.0, np.maximum(height[rows, columns], height[rows, columns + 1])], -1)
    rows, columns = np.nonzero(labels[1:] != labels[:-1])  # one that runs east
    eastward = np.stack([columns + 0.0, rows + 1.0, np.maximum(height[rows, columns], height[rows + 1, columns])], -1)
    half = 0.5 * max(CUT_WIDTH, MIN_CUT_WIDTH * len(labels))
    tall = np.array([[-half, -half], [half, -half], [half, 1 + half], [-half, 1 + half]])
    corners = [_make_ribbons(upright, tall, spacing), _make_ribbons(eastward, tall[:, ::-1], spacing)]
    points = np.concatenate(corners).reshape(-1, 3).astype(np.float32)
    points[:, 2] += CUT_LIFT * spacing * 2**level
    return Layer("faces", points, np.arange(len(points)).reshape(-1, 4), CUT_COLOUR)


def _make_ribbons(starts: Float[Array, "n 3"], shape: Float[Array, "4 2"], spacing: float) -> Float[Array, "n 4 3"]:
    points = np.repeat(starts[:, None], 4, 1)
    points[..., :2] = (points[..., :2] + shape) * spacing
    return points


def compute_heights(field: GaussianField, cells: int, spacing: float) -> Float[Array, "cells cells"]:
    """The ground's height over a tile's finest cells: the highest disc's, of the nearest cell where there is none."""
    from scipy.ndimage import distance_transform_edt

    ground = field[field.ground] if field.ground.any() else field
    out = np.full((cells, cells), -np.inf)
    if not len(ground):
        return np.zeros_like(out)
    column, row = np.clip(ground.means[:, :2] / spacing, 0, cells - 1).astype(int).T
    np.maximum.at(out, (row, column), ground.means[:, 2].astype(float))
    nearest = distance_transform_edt(np.isinf(out), return_distances=False, return_indices=True)
    return out[tuple(nearest)]


def _make_legend(by: str, numbers: list[int], cut: TileSet | None) -> list[ColourBar | ColourKey]:
    if by == "patch":
        return [ColourKey(dict(zip(LABELS, PATCH_COLOURS, strict=True)))]
    cuts = [ColourKey({"cut": CUT_COLOUR})] if cut is not None else []
    return make_legend(by, numbers) + cuts
