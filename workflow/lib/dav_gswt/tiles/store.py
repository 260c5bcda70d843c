"""A tile set on disk: lod{l}_tile_{TT}.ply and labels.npz in one folder, seams.json beside it.

seams.json is written last and holds the counts: where it exists, the set is whole.
"""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.field import read_field, write_field
from dav_gswt.files import UNREADABLE, atomic_folder, read_json, write_json
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.report import TileReport

STAMP = (1980, 1, 1, 0, 0, 0)  # NumPy's own npz carries no better time either


def tile_file_name(level: int, tile: int) -> str:
    return f"lod{level}_tile_{tile:02d}.ply"


def write_tiles(tiles: TileSet, folder: Path | str, seams: Path | str, provenance: dict[str, Any]) -> None:
    """Write the set; `folder` and `seams` appear whole or not at all, the folder first."""
    folder, seams = Path(folder), Path(seams)
    seams.unlink(missing_ok=True)
    with atomic_folder(folder) as part:
        for level, fields in enumerate(tiles.fields):
            for tile, splats in enumerate(progress(fields, f"write tiles of level {level}")):
                write_field(splats, part / tile_file_name(level, tile))
        _write_npz(part / "labels.npz", labels=tiles.labels, shifts=tiles.shifts)
    table = {
        "side": tiles.side,
        "spacing": tiles.spacing,
        "levels": len(tiles.fields),
        "tiles": len(tiles.labels),
        "uncertainty": tiles.uncertainty.tolist(),
        "counts": [[len(f) for f in fields] for fields in tiles.fields],
    }
    write_json(seams, table | {"seams": tiles.report.to_dict(), "provenance": provenance})


def read_tiles(folder: Path | str, seams: Path | str) -> TileSet:
    """Read what `write_tiles` wrote. Raises: InputError: a file is missing or not what seams.json says."""
    folder, table = Path(folder), read_json(seams)
    try:
        levels, count = table["levels"], table["tiles"]
        side, spacing, counts = table["side"], table["spacing"], table["counts"]
        uncertainty, report = np.array(table["uncertainty"]), TileReport.from_dict(table["seams"])
    except (KeyError, TypeError) as error:
        raise InputError(f"{seams}: {error} is missing; cut the tiles again") from None
    fields = [[read_field(folder / tile_file_name(level, tile)) for tile in range(count)] for level in range(levels)]
    if [[len(f) for f in level] for level in fields] != counts:
        raise InputError(f"{folder}: the tiles are not those of {seams}; cut them again")
    try:
        with np.load(folder / "labels.npz", allow_pickle=False) as arrays:
            labels, shifts = arrays["labels"], arrays["shifts"]
    except UNREADABLE as error:
        raise InputError(f"{folder / 'labels.npz'}: not readable ({error}); cut the tiles again") from error
    return TileSet(side, spacing, fields, labels, shifts, uncertainty, report)


def _write_npz(path: Path, **arrays) -> None:
    """Like np.savez_compressed, but the same arrays give the same bytes at any time of day."""
    with zipfile.ZipFile(path, "w") as archive:
        for key, value in arrays.items():
            entry = zipfile.ZipInfo(f"{key}.npy", STAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, value, allow_pickle=False)
