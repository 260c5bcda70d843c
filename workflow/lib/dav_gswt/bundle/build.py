"""Make a bundle of tiles and objects: chunks, archive and manifest, which appear together or not at all."""

import shutil
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle import chunks, direction_search, gswt, level_distances, manifest, orders
from dav_gswt.bundle.chunks import ChunkEntry
from dav_gswt.bundle.content import BundleContent, compute_ground_colour
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.land_cover import ObjectEntry
from dav_gswt.bundle.manifest import Manifest, MaterialEntry, Sky, TileEntry
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
        threads: that sort tiles; they change no byte.
    """

    tau: float
    salt: int = 0
    unit: str = "metre"
    level_pixels: float = 1.0
    band: float = 0.1
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
        made = _write_content(content, options, provenance, part)
        gswt.write_gswt(gswt.bake_objects(content, options.salt), content.side, part / gswt.NAME)
        value = made.to_dict()
        Manifest.from_dict(value)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return made


def _write_content(content: BundleContent, options: BundleOptions, provenance: dict[str, Any], part: Path) -> Manifest:
    """Write the chunks; returns the manifest. Raises: InputError: mean scales that do not rise, an empty tile."""
    levels = [content.tile_fields(level) for level in range(content.levels)]
    tiles = list(zip(*levels, strict=True))
    heights = [_measure_heights(fields) for fields in tiles]
    uncertainties = [u for same in content.tiles for u in np.clip(same.uncertainty, 0, 1).tolist()]
    # the materials in turn: of what errors are measured on each has its share
    in_turn = [each for same in zip(*(own.fields[0] for own in content.tiles), strict=True) for each in same]
    rings = direction_search.search_directions(in_turn, content.side)
    table = level_distances.compute_levels([mean_scale(f) for f in levels], options.level_pixels, options.band)
    objects = list(zip(*(content.object_fields(level) for level in range(content.levels)), strict=True))
    sources = [(f"tile_{number:02d}", *each) for number, each in enumerate(zip(uncertainties, tiles, strict=True))]
    sources += [
        (f"object_{number:02d}", float(np.clip(fields[0].uncertainty.mean(), 0, 1)), fields)
        for number, fields in enumerate(objects)
    ]
    everything = [field for fields in (*tiles, *objects) for field in fields]
    encoding = Encoding.fit(everything, content.side, content.spacing / FLOOR_PIXELS)
    written = _write_chunks(sources, encoding, rings, options, part)
    count, things = len(content.tiles[0].labels), []
    for each, probability, own in zip(content.objects, content.probabilities, written[len(tiles) :], strict=True):
        ground, z = content.ground_height(each.material), _measure_heights(each.fields)
        things.append(ObjectEntry(each.name, each.radius, z, ground, each.material, each.density, probability, own))
    return Manifest(
        tile_side=content.side,
        salt=options.salt,
        eye_floor=level_distances.compute_eye_floor(content.spacing, FLOOR_PIXELS),
        ground_colour=content.ground_colour(),
        directions=rings.directions().tolist(),
        levels=table,
        tiles=[
            TileEntry(tile, *each)
            for tile, each in enumerate(zip(uncertainties, heights, written[: len(tiles)], strict=True))
        ],
        materials=[
            MaterialEntry(material.name, material.share, number * count, compute_ground_colour(same.fields[-1]))
            for number, (material, same) in enumerate(zip(content.materials, content.tiles, strict=True))
        ],
        classes=content.classes,
        objects=things or None,
        scatter=content.scatter,
        format=manifest.FORMAT,
        version=manifest.VERSION,
        unit=options.unit,
        sky=Sky(),
        encoding=encoding,
        provenance=provenance,
    )


def _write_chunks(
    sources: Sequence[tuple[str, float, Sequence[GaussianField]]],
    encoding: Encoding,
    rings: orders.DirectionRings,
    options: BundleOptions,
    part: Path,
) -> list[list[ChunkEntry]]:
    """Write the chunks of tiles and objects, of which the name, the mean uncertainty and the levels are given."""
    along = rings.directions()

    def write(source: tuple[str, float, Sequence[GaussianField]]) -> list[ChunkEntry]:
        (name, uncertainty, fields), entries = source, []
        kept = rings.select_directions(uncertainty, options.tau)
        for level, field in enumerate(fields):
            rows, order = encoding.encode(field), orders.presort(field.means, along[kept])
            entries.append(chunks.write_chunk(rows, order, part, f"chunks/lod{level}_{name}.bin", level, kept))
        return entries

    with ThreadPoolExecutor(options.threads) as pool:
        named = zip(progress(sources, "sort tiles"), pool.map(write, sources), strict=True)
        return [entries for _, entries in named]


def _measure_heights(levels: Sequence[GaussianField]) -> list[float]:
    """Lowest and highest z of the splats, with three of their largest standard deviations around each centre."""
    low, high = np.inf, -np.inf
    for own in levels:
        if not len(own):
            raise InputError("a tile has no splat; the field has a hole as wide as a tile")
        z, radius = own.means[:, 2].astype(float), 3 * np.exp(own.log_scales.astype(float).max(1))
        low, high = min(low, float((z - radius).min())), max(high, float((z + radius).max()))
    return [low, high]


def _move_in(part: Path, out: Path) -> None:
    """Replace a bundle's files in `out`; the manifest goes first and comes last, so a bundle is whole or absent."""
    out.mkdir(parents=True, exist_ok=True)
    (out / manifest.NAME).unlink(missing_ok=True)
    shutil.rmtree(out / "chunks", ignore_errors=True)
    for name in ("chunks", gswt.NAME, manifest.NAME):
        (part / name).replace(out / name)
