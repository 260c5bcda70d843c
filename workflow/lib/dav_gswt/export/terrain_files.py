"""A finite terrain as files of other programs: placed once, on disk, from where each file is made."""

import logging
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.export import glb_splats, ply, sog, spz, tiles_3d, usd
from dav_gswt.export.axes import AXES
from dav_gswt.export.spool import Spool
from dav_gswt.export.terrain_area import (
    TerrainExport,
    check_size,
    choose_limits,
    describe_size,
    find_metres,
    plan_export,
    resolve_lengths,
)
from dav_gswt.field import GaussianField
from dav_gswt.files import atomic_folder, write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, list_blocks, place_block
from dav_gswt.threads import map_ahead

NAME = "terrain"
KEPT = ("unit", "origin", "tile_side", "cells")  # of terrain.json, in files that have a place for it
OWN_AXES = {
    "ply": "y-down",
    "spz": "y-up",
    "glb": "y-up",
    "sog": "y-down",
    "streamed_sog": "y-down",
    "usd": "z-up",
    "3dtiles": "z-up",
}
FIXED_AXES = {"3dtiles"}  # by the specification

_log = logging.getLogger(__name__)


def export_terrain(
    terrain: EndlessTerrain,
    manifest: Manifest,
    settings: Mapping[str, Any],
    out: Path | str,
    threads: int = 1,
    reference: Georeference | None = None,
) -> None:
    """Write terrain.{ply,spz,glb,sog,usdc}, terrain_{sog,3dtiles}/ and terrain.json, as `export` asks, to a folder.

    Args:   reference: where the scene lies on earth, if it is known.
    Raises: InputError: more than a file may have, no such level, metres of a terrain without a scale, or the converter
            of SOG or USD's package is not here.
    """
    settings = resolve_lengths(settings, terrain.side, find_metres(manifest, reference))
    wanted, formats = plan_export(terrain, settings, manifest.eye_floor), settings["formats"]
    limits = choose_limits(settings)
    counts = check_size(terrain, wanted, limits, settings["max_gb"])
    _log.info("%s", describe_size(counts, limits))
    if {"sog", "streamed_sog"} & set(formats):
        sog.find_converter("terrain")
    if "usd" in formats:
        usd.find_package()
    with atomic_folder(out) as folder:
        with _placed(terrain, wanted, folder, threads) as placed:
            facts = _describe(terrain, manifest, wanted, len(placed), reference)
            for name in formats:
                own = settings["axes"] == "own" or name in FIXED_AXES
                facts["files"][name] = axes = OWN_AXES[name] if own else settings["axes"]
                facts["gaussians_by_format"][name] = len(placed)
                _write_format(name, placed, folder, AXES[axes], settings, facts)
        held = facts["gaussians_by_format"]  # these two hold all levels
        if "streamed_sog" in formats:
            rotation = AXES[facts["files"]["streamed_sog"]]
            held["streamed_sog"] = _write_streamed(terrain, wanted, folder, rotation, threads)
        if "3dtiles" in formats:
            spz = settings["tile_compression"] == "spz"
            held["3dtiles"] = _write_tileset(terrain, wanted, folder, facts, reference, spz, threads)
        write_json(folder / f"{NAME}.json", facts)


def _write_format(
    name: str,
    placed: Spool,
    folder: Path,
    rotation: Float[Array, "3 3"],
    settings: Mapping[str, Any],
    facts: dict[str, Any],
) -> None:
    path = folder / f"{NAME}.{name}"
    if name == "ply":
        ply.write_ply(placed, path, rotation)
    elif name == "spz":
        spz.write_spz(placed, path, settings["spz_version"], rotation)
    elif name == "glb":
        extras = {key: facts[key] for key in KEPT}
        glb_splats.write_glb_splats(placed, path, extras, rotation)
    elif name == "sog":
        source = folder / ".sog.ply"
        ply.write_ply(placed, source, rotation)
        sog.convert(source, path, "terrain")
        source.unlink()
    elif name == "usd":
        known = {key: facts[key] for key in KEPT}
        usd.write_usd(placed, path.with_suffix(".usdc"), known, facts["metres_per_unit"] or 1.0, rotation)


def _write_streamed(
    terrain: EndlessTerrain, wanted: TerrainExport, folder: Path, rotation: Float[Array, "3 3"], threads: int
) -> int:
    """Every level of the area in one set, with chunks about as large as a tile; returns the number of Gaussians."""
    sources, count = [], 0
    for level in range(len(terrain.switches)):
        with _placed(terrain, replace(wanted, level=level), folder, threads) as placed:
            count += len(placed)
            sources.append(folder / f".level{level}.ply")
            ply.write_ply(placed, sources[-1], rotation)
    (folder / f"{NAME}_sog").mkdir()
    sog.convert_streamed(sources, folder / f"{NAME}_sog/lod-meta.json", terrain.side, "terrain")
    for source in sources:
        source.unlink()
    return count


def _write_tileset(
    terrain: EndlessTerrain,
    wanted: TerrainExport,
    folder: Path,
    facts: Mapping[str, Any],
    reference: Georeference | None,
    spz: bool,
    threads: int,
) -> int:
    """Every level of the area as 3D Tiles; returns the number of Gaussians."""
    counts = []

    @contextmanager
    def place(area: Area, level: int) -> Iterator[Spool]:
        with _placed(terrain, replace(wanted, area=area, level=level), folder, threads) as placed:
            counts.append(len(placed))
            yield placed

    errors = tiles_3d.measure_errors(terrain)
    transform = tiles_3d.place_on_globe(reference, wanted.origin) if reference else None
    kept = {key: facts[key] for key in KEPT}
    tiles_3d.write_tileset(folder / f"{NAME}_3dtiles", wanted.area, errors, place, kept, transform, spz)
    return sum(counts)


def _describe(
    terrain: EndlessTerrain, manifest: Manifest, wanted: TerrainExport, count: int, reference: Georeference | None
) -> dict[str, Any]:
    """terrain.json. Lengths are in the bundle's unit, the origin is a place of the world, east, north and up."""
    area = wanted.area
    cells: dict[str, Any] = {"west": area.west, "south": area.south, "columns": area.columns, "rows": area.rows}
    if area.disc:
        cells |= {"centre": [area.disc.x, area.disc.y], "radius": area.disc.radius}
    return {
        "unit": manifest.unit,
        "metres_per_unit": find_metres(manifest, reference),
        "tile_side": terrain.side,
        "cells": cells,
        "origin": wanted.origin.tolist(),
        "eye": (wanted.eye - wanted.origin).tolist(),
        "level": "by_distance" if wanted.level is None else wanted.level,
        "gaussians": count,
        "gaussians_by_format": {},
        "files": {},
    }


@contextmanager
def _placed(terrain: EndlessTerrain, wanted: TerrainExport, folder: Path, threads: int) -> Iterator[Spool]:
    """The Gaussians of the area on disk, below a folder, while the block runs."""
    place = folder / ".spool"
    try:
        with Spool(place) as spool:
            for field in place_blocks(terrain, wanted, threads):
                spool.append(field)
        yield spool
    finally:
        shutil.rmtree(place, ignore_errors=True)


def place_blocks(terrain: EndlessTerrain, wanted: TerrainExport, threads: int = 1) -> Iterator[GaussianField]:
    """The Gaussians of an export, block by block; `threads` of them are put on the surface at once, in one order."""
    shown = wanted.select(terrain)
    blocks = progress(list_blocks(shown, wanted.area, wanted.eye), "place cells")
    jobs = (place_block(shown, cells, wanted.eye, wanted.origin) for cells in blocks)
    yield from map_ahead(lambda place: place(), jobs, threads)
