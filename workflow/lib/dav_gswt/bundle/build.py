"""Make a bundle of tiles and objects: chunks, archive and manifest, which appear together or not at all."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle import chunks, direction_search, gswt, level_distances, manifest, orders
from dav_gswt.bundle.chunks import ChunkOrders
from dav_gswt.bundle.content import BundleContent, compute_ground_colour
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.land_cover import ObjectEntry, ObjectOrders
from dav_gswt.bundle.manifest import (
    Manifest,
    MaterialEntry,
    Sky,
    TileEntry,
    TileOrders,
    TileSetInfo,
)
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale
from dav_gswt.files import write_json
from dav_gswt.logs import progress

FLOOR_PIXELS = 12.0  # width of a finest disc in the nearest ground that the lowest eye sees


@dataclass(frozen=True)
class BundleOptions:
    """How tiles are bundled.

    Attributes:
        tau: from this mean uncertainty on, a tile keeps the orders of all directions.
        salt: which of all endless terrains this is (32 bits).
        unit: of lengths, for display.
        level_pixels: mean standard deviation of a level, in pixels, where it takes over from its finer neighbour.
        band: half the width of that cross-fade, as a share of the distance.
        decibels: PSNR from which drawing in a neighbour's order counts as invisible.
        threads: that sort tiles; they change no byte. From two on the archive is written beside them.
    """

    tau: float
    salt: int = 0
    unit: str = "metre"
    level_pixels: float = 1.0
    band: float = 0.1
    decibels: float = 40.0
    threads: int = 1


def write_bundle(
    content: BundleContent, out_dir: Path | str, options: BundleOptions, provenance: dict[str, Any]
) -> Manifest:
    """Write davgswt.json, chunks/ and gswt.zip to a folder; returns the manifest.

    Everything is made beside the folder and moved in when it is whole, the manifest last, so a manifest
    never names a file that is missing. Other entries of the folder stay. gswt.zip has the tiles of the
    first material with its objects baked into them.

    Raises: InputError: mean scales that do not rise, or an empty tile.
    """
    out = Path(out_dir)
    part = out.with_name(f".{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    (part / "chunks").mkdir(parents=True)
    try:
        with ThreadPoolExecutor(1) as beside:
            archive = beside.submit(
                lambda: gswt.write_gswt(gswt.bake_objects(content, options.salt), content.side, part / gswt.NAME)
            )
            if options.threads == 1:
                archive.result()
            try:
                made = _write_content(content, options, provenance, part)
            finally:
                archive.result()  # what it raises says more of the tiles than what else they made fail
        value = made.to_dict()
        Manifest.from_dict(value)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return made


def _write_content(content: BundleContent, options: BundleOptions, provenance: dict[str, Any], part: Path) -> Manifest:
    """Write the chunks; returns the manifest."""
    rings, _ = direction_search.search_directions(content.sample_tiles(), content.side, options.decibels)
    info = describe_tiles(content, options, rings)
    encoding = Encoding.fit(list(content.iterate_fields()), content.side, content.spacing / FLOOR_PIXELS)
    known: dict[str, Any] = vars(info) | _write_chunks(content, encoding, info, options, part)
    return Manifest(
        **known,
        format=manifest.FORMAT,
        version=manifest.VERSION,
        unit=options.unit,
        sky=Sky(),
        encoding=encoding,
        provenance=provenance,
    )


def describe_tiles(content: BundleContent, options: BundleOptions, rings: orders.DirectionRings) -> TileSetInfo:
    """How tiles and objects are placed and drawn.

    Raises: InputError: mean scales that do not rise, an empty tile.
    """
    levels = [content.tile_fields(level) for level in range(content.levels)]
    uncertainties = [u for tiles in content.tiles for u in np.clip(tiles.uncertainty, 0, 1).tolist()]
    count = len(content.tiles[0].labels)

    def keep_orders(uncertainty: float) -> list[ChunkOrders]:
        kept = rings.select_directions(uncertainty, options.tau)
        return [ChunkOrders(level, kept) for level in range(content.levels)]

    objects = []
    for each, probability in zip(content.objects, content.probabilities, strict=True):
        uncertainty = float(np.clip(each.fields[0].uncertainty.mean(), 0, 1))
        ground, z = content.ground_height(each.material), _measure_heights(each.fields)
        place = (each.name, each.radius, z, ground, each.material, each.density, probability)
        objects.append(ObjectOrders(*place, keep_orders(uncertainty)))
    return TileSetInfo(
        tile_side=content.side,
        salt=options.salt,
        eye_floor=level_distances.compute_eye_floor(content.spacing, FLOOR_PIXELS),
        ground_colour=content.ground_colour(),
        directions=rings.directions().tolist(),
        levels=level_distances.compute_levels([mean_scale(f) for f in levels], options.level_pixels, options.band),
        tiles=[
            TileOrders(
                tile, uncertainty, _measure_heights([fields[tile] for fields in levels]), keep_orders(uncertainty)
            )
            for tile, uncertainty in enumerate(uncertainties)
        ],
        materials=[
            MaterialEntry(material.name, material.share, number * count, compute_ground_colour(tiles.fields[-1]))
            for number, (material, tiles) in enumerate(zip(content.materials, content.tiles, strict=True))
        ],
        classes=content.classes,
        objects=objects or None,
        scatter=content.scatter,
    )


def _measure_heights(levels: list[GaussianField]) -> list[float]:
    """Lowest and highest z of the splats, with three of their largest standard deviations around each centre."""
    low, high = np.inf, -np.inf
    for own in levels:
        if not len(own):
            raise InputError("a tile has no splat; the field has a hole as wide as a tile")
        z, radius = own.means[:, 2].astype(float), 3 * np.exp(own.log_scales.astype(float).max(1))
        low, high = min(low, float((z - radius).min())), max(high, float((z + radius).max()))
    return [low, high]


def _write_chunks(
    content: BundleContent, encoding: Encoding, info: TileSetInfo, options: BundleOptions, part: Path
) -> dict[str, list]:
    """Write all chunks; returns the entries of tiles and objects in the manifest."""
    along = np.array(info.directions)
    tiles = [content.tile_fields(level) for level in range(content.levels)]
    things = [content.object_fields(level) for level in range(content.levels)]
    objects = list(info.objects or [])
    sources = [(f"tile_{t.tile:02d}", kept, tiles[kept.level][t.tile]) for t in info.tiles for kept in t.chunks]
    sources += [
        (f"object_{number:02d}", kept, things[kept.level][number])
        for number, each in enumerate(objects)
        for kept in each.chunks
    ]

    def write(source: tuple[str, ChunkOrders, GaussianField]) -> chunks.ChunkEntry:
        name, kept, field = source
        rows, order = encoding.encode(field), orders.presort(field.means, along[kept.orders])
        return chunks.write_chunk(rows, order, part, f"chunks/lod{kept.level}_{name}.bin", kept)

    with ThreadPoolExecutor(options.threads) as pool:
        written = [entry for _, entry in zip(progress(sources, "sort tiles"), pool.map(write, sources), strict=True)]
    groups = iter([written[first : first + content.levels] for first in range(0, len(written), content.levels)])
    entries: dict[str, list] = {
        "tiles": [TileEntry(tile.tile, tile.uncertainty, tile.z, next(groups)) for tile in info.tiles]
    }
    if objects:
        known: list[dict[str, Any]] = [vars(each) | {"chunks": next(groups)} for each in objects]
        entries["objects"] = [ObjectEntry(**values) for values in known]
    return entries


def _move_in(part: Path, out: Path) -> None:
    """Replace a bundle's files in `out`; the manifest goes first and comes last, so a bundle is whole or absent."""
    out.mkdir(parents=True, exist_ok=True)
    (out / manifest.NAME).unlink(missing_ok=True)
    shutil.rmtree(out / "chunks", ignore_errors=True)
    for name in ("chunks", gswt.NAME, manifest.NAME):
        (part / name).replace(out / name)
