"""A finite terrain as files of other programs, placed once, on disk.

Which cells it has, and whether its files can be made, is checked before any work starts.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.export import splat_files
from dav_gswt.export.formats import FORMATS, Format
from dav_gswt.export.spool import ExportJob, Spool
from dav_gswt.field import GaussianField
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, count_cells, list_blocks, list_cells, place_block
from dav_gswt.threads import map_ahead

NAME = "terrain"
KEPT = ("unit", "origin", "tile_side", "cells")  # of terrain.json, in files that have a place for it
MAX_BYTES = 2 * 10**9  # of a file; what would be larger is refused before any work


def choose_area(settings: Mapping[str, Any]) -> Area:
    """The cells that the config's `export` names."""
    (x, y), columns, rows = settings["centre"], settings["columns"], settings["rows"]
    west, south = (int(np.floor(at - n / 2 + 0.5)) for at, n in ((x, columns), (y, rows)))
    return Area(west, south, columns, rows)


def find_origin(terrain: EndlessTerrain, area: Area) -> Float[Array, "3"]:
    """The world position from which the coordinates of an area's files count: its middle, on the plane z = 0."""
    return np.array([area.west + area.columns / 2, area.south + area.rows / 2, 0.0]) * terrain.side


def check_size(terrain: EndlessTerrain, area: Area, level: int, formats: Mapping[str, Format]) -> None:
    """Raises: InputError: a format's files would have more Gaussians than they may have."""
    wanted = {name: 0 if each.all_levels else level for name, each in formats.items()}
    cells = list_cells(terrain, area)
    counts = {each: int(count_cells(terrain, cells, each).sum()) for each in set(wanted.values())}
    for name, each in formats.items():
        count, most = counts[wanted[name]], MAX_BYTES // each.bytes
        bound = min(most, each.gaussians or most)
        if count > bound:
            size = f"{describe_area(area)} up to {count} Gaussians, a file holds {bound}"
            raise InputError(f"export: {name}: {size}; {suggest_size(count, bound)}, or a coarser export.level")


def describe_area(area: Area) -> str:
    """The beginning of a message about an area that is too large."""
    return f"{area.columns} x {area.rows} cells have"


def suggest_size(count: int, bound: int) -> str:
    """How much smaller an area should be, by the square root of the ratio."""
    return f"set export.columns and export.rows to about {(bound / count) ** 0.5:.0%} of that"


def export_terrain(
    terrain: EndlessTerrain,
    manifest: Manifest,
    settings: Mapping[str, Any],
    out: Path | str,
    threads: int = 1,
    reference: Georeference | None = None,
) -> None:
    """Write the files of the formats that `export` names, and terrain.json, to a folder.

    Args:   reference: place on earth, if it is known.
    Raises: InputError: more than a file may have, no such level, or a program that a format needs is not installed.
    """
    area, level = choose_area(settings), settings["level"]
    metres = 1.0 if manifest.unit == "metre" else None
    origin = find_origin(terrain, area)
    formats = {name: FORMATS[name] for name in settings["formats"]}
    if level >= len(terrain.switches):
        raise InputError(f"export.level: there is no level {level}; the last one is {len(terrain.switches) - 1}")
    check_size(terrain, area, level, formats)
    if "sog" in formats:
        splat_files.find_npx()
    with atomic_folder(out) as folder:

        @contextmanager
        def place(area: Area, level: int) -> Iterator[Spool]:
            with TemporaryDirectory(prefix=".spool", dir=folder) as temporary:
                with Spool(Path(temporary, "columns")) as spool:
                    for field in place_blocks(terrain, area, level, origin, threads):
                        spool.append(field)
                yield spool

        with place(area, level) as placed:
            facts: dict[str, Any] = {
                "unit": manifest.unit,
                "metres_per_unit": reference.metres_per_unit if reference else metres,
                "tile_side": terrain.side,
                "cells": vars(area),
                "origin": origin.tolist(),
                "level": level,
                "gaussians": len(placed),
                "gaussians_by_format": {},
                "files": {name: each.axes for name, each in formats.items()},
            }
            job = ExportJob(placed, {key: facts[key] for key in KEPT}, terrain, area, place, reference)
            for name in formats:
                facts["gaussians_by_format"][name] = formats[name].write(job, f"{folder / NAME}") or len(placed)
        write_json(folder / f"{NAME}.json", facts)


def place_blocks(
    terrain: EndlessTerrain, area: Area, level: int, origin: Float[Array, "3"], threads: int = 1
) -> Iterator[GaussianField]:
    """The Gaussians of an area, block by block; `threads` of them are put on the surface at once, in one order.

    origin: world position that positions count from.
    """
    blocks = progress(list_blocks(terrain, area, level), "place cells")
    jobs = (place_block(terrain, cells, level, origin) for cells in blocks)
    yield from map_ahead(lambda place: place(), jobs, threads)
