"""A finite terrain as files of other programs, placed once, on disk, and a patch of its tiles at each level.

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

from dav_gswt.bundle.gswt import read_gswt
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.export.axes import AXES, Y_DOWN, turn_field
from dav_gswt.export.formats import EXPORTERS, Exporter
from dav_gswt.export.spool import Spool
from dav_gswt.field import GaussianField, concatenate_fields, write_field
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, Disc, count_cells, keep_level, list_blocks, place_block
from dav_gswt.threads import map_ahead
from dav_gswt.tiles.layout import EDGES, arrange_torus

NAME = "terrain"
KEPT = ("unit", "origin", "tile_side", "cells")  # of terrain.json, in files that have a place for it
TILES_PER_ROW = 4  # of a patch
BY_DISTANCE = "by_distance"
MAX_CELLS = 1000  # along a side of an area
FARTHEST = 2**30  # tile sides


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


def choose_area(settings: Mapping[str, Any]) -> tuple[Area, tuple[float, float]]:
    """The cells that the config's `export` names, and the point in their middle, in tile sides."""
    x, y = settings.get("centre", (0.0, 0.0))
    if "radius" in settings:
        disc = Disc(x, y, settings["radius"])
        (west, east), (south, north) = (
            (int(np.floor(at - disc.radius)), int(np.ceil(at + disc.radius))) for at in (x, y)
        )
        return Area(west, south, east - west, north - south, disc), (x, y)
    columns, rows = settings["columns"], settings["rows"]
    if "corner" in settings:
        west, south = settings["corner"]
        return Area(west, south, columns, rows), (west + columns / 2, south + rows / 2)
    west, south = (int(np.floor(at - n / 2 + 0.5)) for at, n in ((x, columns), (y, rows)))
    return Area(west, south, columns, rows), (x, y)


def find_metres(manifest: Manifest, reference: Georeference | None) -> float | None:
    """Metres per unit, if they are known."""
    if reference:
        return reference.metres_per_unit
    return 1.0 if manifest.unit == "metre" else None


def resolve_lengths(settings: Mapping[str, Any], side: float, metres: float | None) -> dict[str, Any]:
    """The config's `export` with `radius` and `centre` in tile sides.

    Args:   side: of a tile, in units. metres: per unit, if they are known.
    Raises: InputError: metres for a terrain without a scale, or more cells than an area may have.
    """

    def resolve(name: str, value: float | str) -> float:
        if not isinstance(value, str):
            return float(value)
        if metres is None:
            why = "the scale of this terrain is not known (docs/photos.md): give tile sides, a number without m"
            raise InputError(f"export.{name}: {value}: {why}")
        return float(value.removesuffix("m")) / metres / side

    found = dict(settings)
    if "centre" in found:
        found["centre"] = [resolve("centre", at) for at in found["centre"]]
        if not all(abs(at) <= FARTHEST for at in found["centre"]):
            raise InputError(f"export.centre lies beyond {FARTHEST} tile sides")
    if "radius" in found:
        found["radius"] = resolve("radius", found["radius"])
        if not 1e-6 <= found["radius"] <= MAX_CELLS / 2:  # a smaller one could touch no cell, by rounding
            raise InputError(f"export.radius: {found['radius']:g} tile sides; 0.000001 to {MAX_CELLS // 2} can be")
    return found


def plan_export(terrain: EndlessTerrain, settings: Mapping[str, Any], eye_floor: float) -> TerrainExport:
    """The export of the config's `export`. Raises: InputError: the set has no such level."""
    area, centre = choose_area(settings)
    level = None if settings["level"] == BY_DISTANCE else settings["level"]
    if level is not None and level >= len(terrain.switches):
        raise InputError(f"export.level: there is no level {level}; the last one is {len(terrain.switches) - 1}")
    x, y = (at * terrain.side for at in centre)
    ground = float(terrain.heights.at(np.array([x]), np.array([y]))[0][0])
    return TerrainExport(area, level, np.array([x, y, ground + eye_floor]), find_origin(terrain, area))


def find_origin(terrain: EndlessTerrain, area: Area) -> Float[Array, "3"]:
    """The world position from which the coordinates of an area's files count: its middle, on the plane z = 0."""
    return np.array([area.west + area.columns / 2, area.south + area.rows / 2, 0.0]) * terrain.side


def check_size(
    terrain: EndlessTerrain, wanted: TerrainExport, exporters: Mapping[str, Exporter], max_gb: float
) -> None:
    """Raises: InputError: a format's files would have more Gaussians than they may have."""
    levels = {each.all_levels: replace(wanted, level=0) if each.all_levels else wanted for each in exporters.values()}
    counts = {
        fine: int(count_cells(limited.select(terrain), limited.area, limited.eye).sum())
        for fine, limited in levels.items()
    }
    for name, each in exporters.items():
        count, most = counts[each.all_levels], int(max_gb * 1e9) // each.bytes
        bound = min(most, each.gaussians or most)
        if count > bound:
            why = f"export.max_gb: {max_gb:g} allows" if bound == most else f"the format {name} holds"
            size = f"{describe_area(wanted.area)} up to {count} Gaussians, {why} {bound}"
            hint = suggest_size(wanted.area, count, bound)
            raise InputError(f"export: {name}: {size}; {hint}, a coarser export.level, or a larger export.max_gb")


def describe_area(area: Area) -> str:
    """The beginning of a message about an area that is too large."""
    return f"a radius of {area.disc.radius:g} tiles has" if area.disc else f"{area.columns} x {area.rows} cells have"


def suggest_size(area: Area, count: int, bound: int) -> str:
    """How much smaller an area should be, by the square root of the ratio."""
    keys = "export.radius" if area.disc else "export.columns and export.rows"
    return f"set {keys} to about {(bound / count) ** 0.5:.0%} of that"


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
                facts["gaussians_by_format"][name] = each.write(job) or len(placed)
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
