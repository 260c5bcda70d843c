"""Make a bundle of tiles and objects: chunks, archive and manifest, which appear together or not at all."""

import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle import baking, chunks, direction_search, gswt, level_distances, manifest, order_directions, orders
from dav_gswt.bundle.chunks import ChunkOrders
from dav_gswt.bundle.content import BundleContent, compute_ground_colour
from dav_gswt.bundle.direction_search import DirectionSearchResult
from dav_gswt.bundle.encoding import Encoding, EncodingErrors
from dav_gswt.bundle.land_cover import ObjectEntry, ObjectOrders
from dav_gswt.bundle.manifest import (
    Manifest,
    MaterialEntry,
    OrdersReport,
    RoundingErrors,
    Sky,
    TileEntry,
    TileOrders,
    TileSetInfo,
)
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale
from dav_gswt.files import write_json
from dav_gswt.logs import progress


@dataclass(frozen=True)
class BundleOptions:
    """How tiles are bundled.

    Attributes:
        tau: from this mean uncertainty on, a tile keeps the orders of all directions.
        salt: which of all endless terrains this is (32 bits).
        unit: of lengths, for display.
        level_pixels: mean standard deviation of a level, in pixels, where it takes over from its finer neighbour.
        band: half the width of that cross-fade, as a share of the distance.
        floor_pixels: width in pixels of a finest disc in the nearest ground that the lowest eye sees.
        decibels: PSNR from which drawing in a neighbour's order counts as invisible.
        threads: that sort tiles; they change no byte. From two on archives are written beside them.
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


@dataclass(frozen=True)
class ChunkSource:
    """A chunk to be written: its file's name, its Gaussians, and the orders that it keeps."""

    name: str
    field: GaussianField
    kept: ChunkOrders


def write_bundle(
    content: BundleContent, out_dir: Path | str, options: BundleOptions, schema: Path | str, provenance: dict[str, Any]
) -> Manifest:
    """Write davgswt.json, chunks/ and gswt.zip to a folder; returns the manifest.

    Everything is made beside the folder and moved in when it is whole, the manifest last: a manifest never names a file
    that is not there. Other entries of the folder stay. Each material has an archive (`archive_name`),
    with its objects baked into the tiles.

    Args: schema: workflow/schemas/davgswt.schema.json.
    Raises: InputError: mean scales that do not rise, an empty tile, too many splats; see `level_distances`, `gswt`,
        `manifest`.
    """
    out = Path(out_dir)
    part = out.with_name(f".{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    (part / "chunks").mkdir(parents=True)
    try:
        with ThreadPoolExecutor(1) as beside:
            archives = beside.submit(_write_archives, content, options.salt, part)
            if options.threads == 1:
                archives.result()
            try:
                made = _write_content(content, options, provenance, part)
            finally:
                archives.result()  # what it raises says more of the tiles than what else they made fail
        value = made.to_dict()
        manifest.check_manifest(value, schema)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return made


def _write_archives(content: BundleContent, salt: int, part: Path) -> None:
    """Write the archive of each material."""
    for material in range(len(content.materials)):
        fields = baking.bake_objects(content, material, salt)
        gswt.write_gswt(gswt.fit_to_renderer(fields), content.side, part / archive_name(material))


def _write_content(content: BundleContent, options: BundleOptions, provenance: dict[str, Any], part: Path) -> Manifest:
    """Write the chunks; returns the manifest."""
    found = direction_search.search_directions(content.sample_tiles(), content.side, options.decibels)
    info = describe_tiles(content, options, found.rings)
    pixel = content.spacing / options.floor_pixels
    encoding = Encoding.fit(list(content.iterate_fields()), content.side, pixel)
    entries, errors = _write_chunks(content, encoding, info, options, part)
    known: dict[str, Any] = vars(info) | entries
    rounding: dict[str, Any] = asdict(errors) | _measure_rounding(content, encoding, pixel)
    return Manifest(
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


def archive_name(material: int) -> str:
    """The archive of a material for the public renderer: gswt.zip for the first one, gswt_material1.zip and so on."""
    return f"gswt_material{material}.zip" if material else "gswt.zip"


def describe_tiles(content: BundleContent, options: BundleOptions, rings: orders.DirectionRings) -> TileSetInfo:
    """How tiles and objects are placed and drawn.

    Raises: InputError: mean scales that do not rise, an empty tile.
    """
    levels = [content.tile_fields(level) for level in range(content.levels)]
    uncertainties = [u for tiles in content.tiles for u in np.clip(tiles.uncertainty, 0, 1).tolist()]
    count = len(content.tiles[0].labels)
    return TileSetInfo(
        tile_side=content.side,
        salt=options.salt,
        eye_floor=level_distances.compute_eye_floor(content.spacing, options.floor_pixels),
        ground_colour=content.ground_colour(),
        directions=rings.directions().tolist(),
        levels=level_distances.compute_levels([mean_scale(f) for f in levels], options.level_pixels, options.band),
        tiles=[
            TileOrders(
                tile,
                uncertainty,
                _combine_heights([fields[tile] for fields in levels]),
                _keep_orders(uncertainty, content.levels, rings, options),
            )
            for tile, uncertainty in enumerate(uncertainties)
        ],
        materials=[
            MaterialEntry(material.name, material.share, number * count, compute_ground_colour(tiles.fields[-1]))
            for number, (material, tiles) in enumerate(zip(content.materials, content.tiles, strict=True))
        ],
        classes=content.classes,
        objects=_describe_objects(content, rings, options),
        scatter=content.scatter,
    )


def _describe_objects(
    content: BundleContent, rings: orders.DirectionRings, options: BundleOptions
) -> list[ObjectOrders] | None:
    listed = []
    for each, probability in zip(content.objects, content.probabilities, strict=True):
        uncertainty = float(np.clip(each.fields[0].uncertainty.mean(), 0, 1))
        ground, z = content.ground_height(each.material), _combine_heights(each.fields)
        place = (each.name, each.radius, z, ground, each.material, each.density, probability)
        listed.append(ObjectOrders(*place, _keep_orders(uncertainty, content.levels, rings, options)))
    return listed or None


def _keep_orders(
    uncertainty: float, levels: int, rings: orders.DirectionRings, options: BundleOptions
) -> list[ChunkOrders]:
    kept = rings.select_directions(uncertainty, options.tau)
    return [ChunkOrders(level, kept) for level in range(levels)]


def _combine_heights(fields: list[GaussianField]) -> list[float]:
    """Lowest and highest z over all levels."""
    ranges = [measure_heights(field) for field in fields]
    return [min(low for low, _ in ranges), max(high for _, high in ranges)]


def _write_chunks(
    content: BundleContent, encoding: Encoding, info: TileSetInfo, options: BundleOptions, part: Path
) -> tuple[dict[str, list], EncodingErrors]:
    """Write all chunks; returns the entries of tiles and objects in the manifest, and the largest errors."""
    along, pixel = np.array(info.directions), content.spacing / options.floor_pixels

    def write(source: ChunkSource) -> tuple[chunks.ChunkEntry, EncodingErrors]:
        field, kept = source.field, source.kept
        rows, order = encoding.encode(field), orders.presort(field.means, along[kept.orders])
        entry = chunks.write_chunk(rows, order, part, source.name, kept)
        return entry, EncodingErrors.measure(encoding, field, rows, pixel)

    sources = list(_list_chunks(content, info))
    written, errors = [], EncodingErrors()
    with ThreadPoolExecutor(options.threads) as pool:
        for _, (entry, more) in zip(progress(sources, "sort tiles"), pool.map(write, sources), strict=True):
            written.append(entry)
            errors = errors.combine(more)
    count = content.levels
    groups = iter([written[first : first + count] for first in range(0, len(written), count)])
    entries: dict[str, list] = {
        "tiles": [TileEntry(tile.tile, tile.uncertainty, tile.z, next(groups)) for tile in info.tiles]
    }
    if info.objects:
        known: list[dict[str, Any]] = [vars(each) | {"chunks": next(groups)} for each in info.objects]
        entries["objects"] = [ObjectEntry(**values) for values in known]
    return entries, errors


def _list_chunks(content: BundleContent, info: TileSetInfo) -> Iterator[ChunkSource]:
    """All chunks: tile by tile, then object by object, the finest level first."""
    tiles = [content.tile_fields(level) for level in range(content.levels)]
    things = [content.object_fields(level) for level in range(content.levels)]
    for tile in info.tiles:
        for kept in tile.chunks:
            name = f"chunks/lod{kept.level}_tile_{tile.tile:02d}.bin"
            yield ChunkSource(name, tiles[kept.level][tile.tile], kept)
    for number, each in enumerate(info.objects or []):
        for kept in each.chunks:
            yield ChunkSource(f"chunks/lod{kept.level}_object_{number:02d}.bin", things[kept.level][number], kept)


def _measure_rounding(content: BundleContent, encoding: Encoding, pixel: float) -> dict[str, float | None]:
    """PSNR of rounded tiles against the tiles, as near as the lowest eye sees them: {elevation}_db."""
    found, tiles = {}, content.sample_tiles()
    for name, elevation in order_directions.ELEVATIONS.items():
        pairs = []
        for view in order_directions.spread_views(len(tiles), elevation):
            source = tiles[view.tile]
            rounded = encoding.decode(encoding.encode(source))
            first, second = (
                order_directions.render_in_order(f, content.side, view.direction, pixel) for f in (rounded, source)
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
    z, radius = field.means[:, 2].astype(float), 3 * np.exp(field.log_scales.astype(float).max(1))
    return float((z - radius).min()), float((z + radius).max())


def _move_in(part: Path, out: Path) -> None:
    """Replace a bundle's files in `out`; the manifest goes first and comes last, so a bundle is whole or absent."""
    out.mkdir(parents=True, exist_ok=True)
    (out / manifest.NAME).unlink(missing_ok=True)
    shutil.rmtree(out / "chunks", ignore_errors=True)
    for old in out.glob("gswt_material*.zip"):
        old.unlink()
    for name in ("chunks", *sorted(path.name for path in part.glob("*.zip")), manifest.NAME):
        (part / name).replace(out / name)
