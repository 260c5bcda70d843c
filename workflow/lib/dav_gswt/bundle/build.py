"""A bundle from a tile set: chunks, archive and manifest, which appear together or not at all."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle import chunks, direction_search, gswt, level_distances, manifest, order_directions, orders
from dav_gswt.bundle.chunks import ChunkOrders
from dav_gswt.bundle.direction_search import DirectionSearchResult
from dav_gswt.bundle.encoding import Encoding, EncodingErrors
from dav_gswt.bundle.manifest import Manifest, OrdersReport, RoundingErrors, Sky, TileEntry, TileOrders, TileSetInfo
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet


@dataclass(frozen=True)
class BundleOptions:
    """How a tile set is bundled.

    Attributes:
        tau: from this mean uncertainty on, a tile keeps the orders of all directions.
        salt: which of all endless terrains this is (32 bits).
        unit: of lengths, for people.
        level_pixels: mean standard deviation of a level, in pixels, where it takes over from its finer neighbour.
        band: half the width of that cross-fade, as a share of the distance.
        floor_pixels: width in pixels of a finest disc in the nearest ground that the lowest eye sees.
        decibels: PSNR from which drawing in a neighbour's order counts as invisible.
        threads: that sort tiles; they change no byte.
        sky: behind everything.
    """

    tau: float
    salt: int = 0
    unit: str = "metre"
    level_pixels: float = 1.0
    band: float = 0.1
    floor_pixels: float = 12.0
    decibels: float = 40.0
    threads: int = 1
    sky: Sky = field(default_factory=Sky)


def write_bundle(
    tiles: TileSet, out_dir: Path | str, options: BundleOptions, schema: Path | str, provenance: dict[str, Any]
) -> Manifest:
    """Write davgswt.json, chunks/ and gswt.zip to a folder; returns the manifest.

    Everything is made beside the folder and moved in when it is whole, the manifest last: a manifest never names a file
    that is not there. Other entries of the folder stay.

    Args: schema: workflow/schemas/davgswt.schema.json.
    Raises: InputError: mean scales that do not rise, an empty tile, too many splats; see `level_distances`, `gswt`,
        `manifest`.
    """
    out = Path(out_dir)
    part = out.with_name(f".{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    (part / "chunks").mkdir(parents=True)
    try:
        gswt.write_gswt(tiles.fields, tiles.side, part / "gswt.zip")
        found = direction_search.search_directions(tiles.fields[0], tiles.side, options.decibels)
        info = describe_tiles(tiles, options, found.rings)
        pixel = tiles.spacing / options.floor_pixels
        encoding = Encoding.fit([f for level in tiles.fields for f in level], tiles.side, pixel)
        entries, errors = _write_chunks(tiles, encoding, info, options, part)
        known: dict[str, Any] = vars(info) | {"tiles": entries}
        rounding: dict[str, Any] = asdict(errors) | _measure_rounding(tiles, encoding, pixel)
        made = Manifest(
            **known,
            format=manifest.FORMAT,
            version=manifest.VERSION,
            unit=options.unit,
            sky=options.sky,
            encoding=encoding,
            error=RoundingErrors(**rounding),
            orders=_describe_orders(found, options),
            provenance=provenance,
        )
        value = made.to_dict()
        manifest.check_manifest(value, schema)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return made


def describe_tiles(tiles: TileSet, options: BundleOptions, rings: orders.DirectionRings) -> TileSetInfo:
    """How the tiles are placed and drawn.

    Raises: InputError: mean scales that do not rise, an empty tile.
    """
    scales = [mean_scale(level) for level in tiles.fields]
    listed = []
    for tile, uncertainty in enumerate(np.clip(tiles.uncertainty, 0, 1).tolist()):
        ranges = [measure_heights(fields[tile]) for fields in tiles.fields]
        heights = [min(low for low, _ in ranges), max(high for _, high in ranges)]
        kept = rings.select(uncertainty, options.tau)
        entries = [ChunkOrders(level, kept) for level in range(len(tiles.fields))]
        listed.append(TileOrders(tile, uncertainty, heights, entries))
    return TileSetInfo(
        tile_side=tiles.side,
        salt=options.salt,
        eye_floor=level_distances.compute_eye_floor(tiles.spacing, options.floor_pixels),
        ground_colour=_compute_ground_colour(tiles.fields[-1]),
        directions=rings.directions().tolist(),
        levels=level_distances.compute_levels(scales, options.level_pixels, options.band),
        tiles=listed,
    )


def _write_chunks(
    tiles: TileSet, encoding: Encoding, info: TileSetInfo, options: BundleOptions, part: Path
) -> tuple[list[TileEntry], EncodingErrors]:
    """Write all chunks; returns the tiles' entries in the manifest, and the largest errors of the records."""
    along, pixel = np.array(info.directions), tiles.spacing / options.floor_pixels

    def write(place: tuple[int, ChunkOrders]) -> tuple[chunks.ChunkEntry, EncodingErrors]:
        tile, kept = place
        source, name = tiles.fields[kept.level][tile], f"chunks/lod{kept.level}_tile_{tile:02d}.bin"
        rows, order = encoding.encode(source), orders.presort(source.means, along[kept.orders])
        return chunks.write_chunk(rows, order, part, name, kept), EncodingErrors.measure(encoding, source, rows, pixel)

    places = [(tile.tile, kept) for tile in info.tiles for kept in tile.chunks]
    written, errors = [], EncodingErrors()
    with ThreadPoolExecutor(options.threads) as pool:
        for _, (entry, more) in zip(progress(places, "sort tiles"), pool.map(write, places), strict=True):
            written.append(entry)
            errors = errors.combine(more)
    count = len(info.levels)
    entries = [
        TileEntry(tile.tile, tile.uncertainty, tile.z, written[number * count : (number + 1) * count])
        for number, tile in enumerate(info.tiles)
    ]
    return entries, errors


def _measure_rounding(tiles: TileSet, encoding: Encoding, pixel: float) -> dict[str, float | None]:
    """PSNR of rounded tiles against the tiles, as near as the lowest eye sees them: {elevation}_db."""
    found = {}
    for name, elevation in order_directions.ELEVATIONS.items():
        pairs = []
        for view in order_directions.spread_views(len(tiles.labels), elevation):
            source = tiles.fields[0][view.tile]
            rounded = encoding.decode(encoding.encode(source))
            first, second = (
                order_directions.render_in_order(f, tiles.side, view.direction, pixel) for f in (rounded, source)
            )
            pairs.append((first, second))
        found[f"{name}_db"] = order_directions.compute_psnr(pairs)
    return found


def _describe_orders(found: DirectionSearchResult, options: BundleOptions) -> OrdersReport:
    rings, decibels = found.rings, found.decibels
    return OrdersReport(
        list(rings.elevations), rings.azimuths, options.tau, options.decibels, decibels["walker"], decibels["oblique"]
    )


def measure_heights(field: GaussianField) -> tuple[float, float]:
    """Lowest and highest z of the splats, with three of their largest standard deviations around each centre."""
    if not len(field):
        raise InputError("a tile has no splat; the field has a hole as wide as a tile")
    z, reach = field.means[:, 2].astype(float), 3 * np.exp(field.log_scales.astype(float).max(1))
    return float((z - reach).min()), float((z + reach).max())


def _compute_ground_colour(fields: list[GaussianField]) -> list[float]:
    """Mean colour of the ground, or of all splats where none is ground."""
    ground = [f.base_colours[f.ground] for f in fields if f.ground.any()] or [f.base_colours for f in fields]
    return np.clip(np.concatenate(ground).astype(float).mean(0), 0, 1).tolist()


def _move_in(part: Path, out: Path) -> None:
    """Replace a bundle's files in `out`; the manifest goes first and comes last, so a bundle is whole or absent."""
    out.mkdir(parents=True, exist_ok=True)
    (out / manifest.NAME).unlink(missing_ok=True)
    shutil.rmtree(out / "chunks", ignore_errors=True)
    for name in ("chunks", "gswt.zip", manifest.NAME):
        (part / name).replace(out / name)
