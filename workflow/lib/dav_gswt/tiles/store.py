"""A tile set on disk: lod{l}_tile_{TT}.ply and labels.npz in one folder, seams.json beside it.

seams.json is written last and holds the counts: where it exists, the set is whole. The sets of further materials are
in the folders material1, material2, ... of the first one's, their tables in its seams.json under `materials`.
"""

from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.field import read_field, write_field
from dav_gswt.files import UNREADABLE, atomic_folder, read_json, write_json
from dav_gswt.lod.store import material_folder
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import Layout


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
            for level, fields in enumerate(tiles.fields):
                for tile, splats in enumerate(progress(fields, f"write tiles of level {level}")):
                    write_field(splats, own / tile_file_name(level, tile))
            np.savez_compressed(own / "labels.npz", labels=tiles.labels, shifts=tiles.shifts)
    first, *more = [_describe_tiles(tiles) for tiles in sets]
    write_json(seams, first | {"provenance": provenance} | ({"materials": more} if more else {}))


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


def read_tiles(folder: Path | str, seams: Path | str) -> TileSet:
    """Read the set of the first material. Raises: InputError: a file is missing or not what seams.json says."""
    return _read_folder(Path(folder), read_json(seams), seams)


def read_material_tiles(folder: Path | str, seams: Path | str) -> list[TileSet]:
    """Read what `write_tiles` wrote. Raises: InputError: as `read_tiles`."""
    table = read_json(seams)
    more = table.get("materials", []) if isinstance(table, dict) else []
    if not isinstance(more, list):
        raise InputError(f"{seams}: not the table of a tile set (materials is no list); cut the tiles again")
    return [_read_folder(material_folder(folder, k), own, seams) for k, own in enumerate([table, *more])]


def _read_folder(folder: Path, table: Any, seams: Path | str) -> TileSet:
    try:
        levels, count = table["levels"], table["tiles"]
        side, spacing, counts, report = table["side"], table["spacing"], table["counts"], table["seams"]
        uncertainty, _ = np.array(table["uncertainty"]), Layout.from_dict(report["layout"])
        if not all(type(n) is int and n > 0 for n in (levels, count)) or not 0 < side < np.inf:
            raise ValueError("a size is out of range")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else summarize_error(error)
        raise InputError(f"{seams}: not the table of a tile set ({why}); cut the tiles again") from error
    fields = [[read_field(folder / tile_file_name(level, tile)) for tile in range(count)] for level in range(levels)]
    if [[len(f) for f in level] for level in fields] != counts:
        raise InputError(f"{folder}: the tiles are not those of {seams}; cut them again")
    try:
        with np.load(folder / "labels.npz", allow_pickle=False) as arrays:
            labels, shifts = arrays["labels"], arrays["shifts"]
    except UNREADABLE as error:
        raise InputError(f"{folder / 'labels.npz'}: not readable ({error}); cut the tiles again") from error
    return TileSet(side, spacing, fields, labels, shifts, uncertainty, report)
