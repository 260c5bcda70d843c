"""A finite terrain as files of other programs, placed once, on disk.

Which cells it has, and whether its files can be made, is checked before any work starts.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.export.formats import EXPORTERS, Exporter
from dav_gswt.export.spool import Spool
from dav_gswt.field import GaussianField
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, count_cells, keep_level, list_blocks, place_block
from dav_gswt.threads import map_ahead

NAME = "terrain"
KEPT = ("unit", "origin", "tile_side", "cells")  # of terrain.json, in files that have a place for it
BY_DISTANCE = "by_distance"
MAX_BYTES = 2 * 10**9  # of a file; what would be larger is refused before any work


@dataclass(frozen=True)
class TerrainExport:
    """What the config's `export` asks for: cells, their level (None: by the distance from the eye), and the eye.

    Attributes:
        origin: world position from which the files' coordinates count: the middle of the area on the plane z = 0.
    """

    area: Area
    level: int | None
    eye: Float[Array, "3"]
    origin: Float[Array, "3"]

    def select(self, terrain: EndlessTerrain) -> EndlessTerrain:
        """The terrain at the requested level."""
        return terrain if self.level is None else keep_level(terrain, self.level)


def choose_area(settings: Mapping[str, Any]) -> Area:
    """The cells that the config's `export` names."""
    (x, y), columns, rows = settings["centre"], settings["columns"], settings["rows"]
    west, south = (int(np.floor(at - n / 2 + 0.5)) for at, n in ((x, columns), (y, rows)))
    return Area(west, south, columns, rows)


def find_metres(manifest: Manifest, reference: Georeference | None) -> float | None:
    """Metres per unit, if they are known."""
    if reference:
        return reference.metres_per_unit
    return 1.0 if manifest.unit == "metre" else None


def plan_export(terrain: EndlessTerrain, settings: Mapping[str, Any], eye_floor: float) -> TerrainExport:
    """The export of the config's `export`. Raises: InputError: the set has no such level."""
    area = choose_area(settings)
    level = None if settings["level"] == BY_DISTANCE else settings["level"]
    if level is not None and level >= len(terrain.switches):
        raise InputError(f"export.level: there is no level {level}; the last one is {len(terrain.switches) - 1}")
    x, y = (at * terrain.side for at in settings["centre"])
    ground = float(terrain.heights.at(np.array([x]), np.array([y]))[0][0])
    return TerrainExport(area, level, np.array([x, y, ground + eye_floor]), find_origin(terrain, area))


def find_origin(terrain: EndlessTerrain, area: Area) -> Float[Array, "3"]:
    """The world position from which the coordinates of an area's files count: its middle, on the plane z = 0."""
    return np.array([area.west + area.columns / 2, area.south + area.rows / 2, 0.0]) * terrain.side


def check_size(terrain: EndlessTerrain, wanted: TerrainExport, exporters: Mapping[str, Exporter]) -> None:
    """Raises: InputError: a format's files would have more Gaussians than they may have."""
    levels = {each.all_levels: replace(wanted, level=0) if each.all_levels else wanted for each in exporters.values()}
    counts = {
        fine: int(count_cells(limited.select(terrain), limited.area, limited.eye).sum())
        for fine, limited in levels.items()
    }
    for name, each in exporters.items():
        count, most = counts[each.all_levels], MAX_BYTES // each.bytes
        bound = min(most, each.gaussians or most)
        if count > bound:
            size = f"{describe_area(wanted.area)} up to {count} Gaussians, a file holds {bound}"
            raise InputError(f"export: {name}: {size}; {suggest_size(count, bound)}, or a coarser export.level")


def describe_area(area: Area) -> str:
    """The beginning of a message about an area that is too large."""
    return f"{area.columns} x {area.rows} cells have"


def suggest_size(count: int, bound: int) -> str:
    """How much smaller an area should be, by the square root of the ratio."""
    return f"set export.columns and export.rows to about {(bound / count) ** 0.5:.0%} of that"


@dataclass(frozen=True)
class ExportJob:
    """What an exporter writes, and where.

    Attributes:
        stem: path of the files without their suffix.
        spool: the Gaussians of the area at the requested level.
        facts: about the files, for formats that keep such.
        place: puts cells on the surface at a level, on disk while its block runs.
        reference: place on earth, if it is known.
    """

    stem: Path
    spool: Spool
    facts: Mapping[str, Any]
    terrain: EndlessTerrain
    area: Area
    place: Callable[[Area, int], AbstractContextManager[Spool]]
    reference: Georeference | None

    def path(self, suffix: str) -> Path:
        """The path of a file or folder of the export."""
        return self.stem.with_name(self.stem.name + suffix)


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
    wanted = plan_export(terrain, settings, manifest.eye_floor)
    chosen = {name: EXPORTERS[name] for name in settings["formats"]}
    check_size(terrain, wanted, chosen)
    for each in chosen.values():
        if each.check:
            each.check()
    with atomic_folder(out) as folder:

        @contextmanager
        def place(area: Area, level: int | None) -> Iterator[Spool]:
            with TemporaryDirectory(prefix=".spool", dir=folder) as temporary:
                with Spool(Path(temporary, "columns")) as spool:
                    for field in place_blocks(terrain, replace(wanted, area=area, level=level), threads):
                        spool.append(field)
                yield spool

        with place(wanted.area, wanted.level) as placed:
            facts = _describe(terrain, manifest.unit, find_metres(manifest, reference), wanted, len(placed))
            kept = {key: facts[key] for key in KEPT}
            for name, each in chosen.items():
                facts["files"][name] = each.axes
                job = ExportJob(folder / NAME, placed, kept, terrain, wanted.area, place, reference)
                facts["gaussians_by_format"][name] = each.write(job) or len(placed)
        write_json(folder / f"{NAME}.json", facts)


def _describe(
    terrain: EndlessTerrain, unit: str, metres: float | None, wanted: TerrainExport, count: int
) -> dict[str, Any]:
    """terrain.json. Lengths are in the bundle's unit; the origin is a world position, east, north and up."""
    area = wanted.area
    cells: dict[str, Any] = {"west": area.west, "south": area.south, "columns": area.columns, "rows": area.rows}
    return {
        "unit": unit,
        "metres_per_unit": metres,
        "tile_side": terrain.side,
        "cells": cells,
        "origin": wanted.origin.tolist(),
        "eye": (wanted.eye - wanted.origin).tolist(),
        "level": "by_distance" if wanted.level is None else wanted.level,
        "gaussians": count,
        "gaussians_by_format": {},
        "files": {},
    }


def place_blocks(terrain: EndlessTerrain, wanted: TerrainExport, threads: int = 1) -> Iterator[GaussianField]:
    """The Gaussians of an export, block by block; `threads` of them are put on the surface at once, in one order."""
    shown = wanted.select(terrain)
    blocks = progress(list_blocks(shown, wanted.area, wanted.eye), "place cells")
    jobs = (place_block(shown, cells, wanted.eye, wanted.origin) for cells in blocks)
    yield from map_ahead(lambda place: place(), jobs, threads)
