"""A tile set on disk: labels.npz in one folder, seams.json beside it.

labels.npz has labels, shifts and what composed tiles need beside the levels: the trend that is taken out of these and
each tile's corrections. Tiles that are not composed are lod{l}_tile_{TT}.ply beside it.

seams.json has the turn of an exemplar whose ground is regular, which the levels lack. It is written last and holds the
counts: where it exists, the set is whole. The sets of further materials are in the folders material1, material2, ... of
the first one's, their tables in its seams.json under `materials`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.field import GaussianField, read_field, write_field
from dav_gswt.files import UNREADABLE, atomic_folder, read_json, write_json
from dav_gswt.lod.store import Levels, material_folder, read_levels, read_material_levels
from dav_gswt.logs import progress
from dav_gswt.tiles.build import Recipe, TileSet, compose_tiles
from dav_gswt.tiles.compose import bin_gaussians
from dav_gswt.tiles.layout import Exemplar, Layout
from dav_gswt.tiles.periods import turn_levels
from dav_gswt.tiles.texture import Trend, remove_trend


def tile_file_name(level: int, tile: int) -> str:
    return f"lod{level}_tile_{tile:02d}.ply"


def write_tiles(sets: list[TileSet], folder: Path | str, seams: Path | str, provenance: dict[str, Any]) -> None:
    """Write the sets of several materials; `folder` and `seams` appear whole or not at all, the folder first."""
    folder, seams = Path(folder), Path(seams)
    seams.unlink(missing_ok=True)
    with atomic_folder(folder) as part:
        for number, tiles in enumerate(sets):
            own = material_folder(part, number)
            own.mkdir(exist_ok=True)
            arrays: dict[str, Any] = {"labels": tiles.labels, "shifts": tiles.shifts}
            if recipe := tiles.recipe:
                arrays |= {"colour": recipe.trend.colour, "height": recipe.trend.height}
                arrays |= {"corrections": recipe.corrections}
            else:
                write_tile_fields(tiles.fields, own)
            np.savez_compressed(own / "labels.npz", **arrays)
    first, *more = [_describe_tiles(tiles) for tiles in sets]
    write_json(seams, first | {"provenance": provenance} | ({"materials": more} if more else {}))


def write_tile_fields(fields: list[list[GaussianField]], folder: Path) -> None:
    """Write lod{l}_tile_{TT}.ply of fields[level][tile]."""
    for level, tiles in enumerate(fields):
        for tile, splats in enumerate(progress(tiles, f"write tiles of level {level}")):
            write_field(splats, folder / tile_file_name(level, tile))


def _describe_tiles(tiles: TileSet) -> dict[str, Any]:
    return {
        "side": tiles.side,
        "spacing": tiles.spacing,
        "levels": len(tiles.fields),
        "tiles": len(tiles.labels),
        "uncertainty": tiles.uncertainty.tolist(),
        "counts": [[len(f) for f in fields] for fields in tiles.fields],
        "seams": tiles.report,
    }


def read_tiles(folder: Path | str, seams: Path | str, levels: Path | str) -> TileSet:
    """Read the set of the first material. levels: the folder of the levels that the tiles are composed of.

    Raises: InputError: a file is missing, or not what seams.json says; see also `lod.store.read_levels`.
    """
    return _read_folder(Path(folder), read_json(seams), seams, Path(levels))


def read_material_tiles(folder: Path | str, seams: Path | str, levels: Path | str) -> list[TileSet]:
    """Read what `write_tiles` wrote. Raises: InputError: as `read_tiles`."""
    table = read_json(seams)
    more = table.get("materials", []) if isinstance(table, dict) else []
    if not isinstance(more, list):
        raise InputError(f"{seams}: not the table of a tile set (materials is no list); cut the tiles again")
    return [
        _read_folder(material_folder(folder, k), own, seams, material_folder(levels, k))
        for k, own in enumerate([table, *more])
    ]


def _read_folder(folder: Path, table: Any, seams: Path | str, levels: Path) -> TileSet:
    try:
        number, count = table["levels"], table["tiles"]
        side, spacing, counts, report = table["side"], table["spacing"], table["counts"], table["seams"]
        uncertainty, plan = np.array(table["uncertainty"]), Layout.from_dict(report["layout"])
        if not all(type(n) is int and n > 0 for n in (number, count)) or not 0 < side < np.inf:
            raise ValueError("a size is out of range")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else summarize_error(error)
        raise InputError(f"{seams}: not the table of a tile set ({why}); cut the tiles again") from error
    try:
        with np.load(folder / "labels.npz", allow_pickle=False) as stored:
            arrays = dict(stored)
        labels, shifts = arrays["labels"], arrays["shifts"]
    except UNREADABLE as error:
        raise InputError(f"{folder / 'labels.npz'}: not readable ({error}); cut the tiles again") from error
    recipe = None
    if "colour" in arrays:
        try:
            recipe = _make_recipe(arrays, turn_levels_of(report, read_levels(levels)), plan)
            fields = compose_tiles(recipe, plan, labels, shifts)
        except UNREADABLE as error:
            raise InputError(f"{folder / 'labels.npz'}: not of {levels} ({error}); cut the tiles again") from error
    else:
        names = [[tile_file_name(level, tile) for tile in range(count)] for level in range(number)]
        fields = [[read_field(folder / name) for name in level] for level in names]
    if [[len(f) for f in level] for level in fields] != counts:
        raise InputError(f"{folder}: the tiles are not those of {seams}; cut them again")
    return TileSet(side, spacing, fields, labels, shifts, uncertainty, report, recipe)


def read_exemplars(seams: Path | str, levels: Path | str) -> list[Levels]:
    """The levels of each material as its tiles were cut from them. Raises: InputError: as `read_tiles`."""
    table = read_json(seams)
    reports = [own["seams"] for own in (table, *table.get("materials", []))]
    return [turn_levels_of(*each) for each in zip(reports, read_material_levels(levels), strict=True)]


def turn_levels_of(report: dict[str, Any], levels: Levels) -> Levels:
    """Levels turned as the report of the tiles says; as they are for ground without a pattern."""
    pattern = report.get("pattern")
    return turn_levels(levels, np.array(pattern["turn"]), report["layout"]["exemplar"]) if pattern else levels


def _make_recipe(arrays: dict[str, Array], levels: Levels, plan: Layout) -> Recipe:
    """The recipe of a set, with the levels that it was cut from."""
    exemplar = Exemplar.from_grid(levels.grids[0])
    trend = Trend(exemplar, arrays["colour"], arrays["height"])
    flat = [remove_trend(field, trend) for field in levels.fields[: plan.composed_levels]]
    binned = [bin_gaussians(field, exemplar, 2**level) for level, field in enumerate(flat)]
    return Recipe(binned, trend, arrays["corrections"])
