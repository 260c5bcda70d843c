"""A finite terrain as files of other programs, placed once, on disk, and a patch of its tiles at each level."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.gswt import read_gswt
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.export.axes import AXES, Y_DOWN, turn_field
from dav_gswt.export.formats import EXPORTERS
from dav_gswt.export.spool import Spool
from dav_gswt.export.terrain_area import TerrainExport, check_size, find_metres, plan_export, resolve_lengths
from dav_gswt.field import GaussianField, concatenate_fields, write_field
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, list_blocks, place_block
from dav_gswt.threads import map_ahead
from dav_gswt.tiles.layout import EDGES, arrange_torus

NAME = "terrain"
KEPT = ("unit", "origin", "tile_side", "cells")  # of terrain.json, in files that have a place for it
TILES_PER_ROW = 4  # of a patch


@dataclass(frozen=True)
class ExportJob:
    """What an exporter writes, and where.

    Attributes:
        stem: path of the files without their suffix.
        spool: the Gaussians of the area at the requested level.
        rotation: rows of `axes.AXES`.
        facts: about the files, for formats that keep such.
        place: puts cells on the surface at a level, on disk while its block runs.
        reference: place on earth, if it is known.
    """

    stem: Path
    spool: Spool
    rotation: Float[Array, "3 3"]
    facts: Mapping[str, Any]
    metres_per_unit: float | None
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
    Raises: InputError: more than a file may have, no such level, metres for a terrain without a scale, or a program or
            package that a format needs is not installed.
    """
    metres = find_metres(manifest, reference)
    settings = resolve_lengths(settings, terrain.side, metres)
    wanted = plan_export(terrain, settings, manifest.eye_floor)
    chosen = {name: EXPORTERS[name] for name in settings["formats"]}
    check_size(terrain, wanted, chosen, settings["max_gb"])
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
            facts = _describe(terrain, manifest.unit, metres, wanted, len(placed))
            kept = {key: facts[key] for key in KEPT}
            for name, each in chosen.items():
                facts["files"][name] = axes = settings["axes"] if settings["axes"] in each.axes else each.axes[0]
                about = (kept, metres, terrain, wanted.area, place, reference)
                job = ExportJob(folder / NAME, placed, AXES[axes], *about)
                facts["gaussians_by_format"][name] = each.write(job)
        write_json(folder / f"{NAME}.json", facts)


def _describe(
    terrain: EndlessTerrain, unit: str, metres: float | None, wanted: TerrainExport, count: int
) -> dict[str, Any]:
    """terrain.json. Lengths are in the bundle's unit; the origin is a world position, east, north and up."""
    area = wanted.area
    cells: dict[str, Any] = {"west": area.west, "south": area.south, "columns": area.columns, "rows": area.rows}
    if area.disc:
        cells |= {"centre": [area.disc.x, area.disc.y], "radius": area.disc.radius}
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


def assemble_patch(fields: list[GaussianField], side: float) -> GaussianField:
    """One level's tiles side by side, four by four for each variant; the south-western corner is the origin.

    All tiles are visible, no border inside the patch is, and copies of it can be placed side by side without a seam.
    """
    parts = []
    for variant in range(len(fields) // EDGES):
        for (row, column), tile in np.ndenumerate(arrange_torus(variant)[1:-1, 1:-1]):
            corner = np.array([(TILES_PER_ROW * variant + column) * side, row * side, 0.0], np.float32)
            parts.append(replace(fields[tile], means=fields[tile].means + corner))
    return concatenate_fields(parts)


def write_plys(archive: Path | str, side: float, out: Path | str) -> None:
    """Write level{l}.ply, y down, of every level of a gswt.zip to a folder. Raises: InputError: see `read_gswt`."""
    with atomic_folder(out) as folder:
        for level, tiles in enumerate(progress(read_gswt(archive, side), "write patches")):
            write_field(turn_field(assemble_patch(tiles, side), Y_DOWN), folder / f"level{level}.ply", plain=True)
