"""A bundle from a tile set: chunks, zip and manifest, which appear together or not at all."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from dav_gswt.bundle import chunks, direction_search, gswt, level_distances, manifest, order_directions, orders
from dav_gswt.bundle.direction_search import DirectionSearchResult
from dav_gswt.bundle.encoding import Encoding, EncodingErrors
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet


@dataclass(frozen=True)
class BundleOptions:
    """tau: from which mean uncertainty on a tile is deep. salt: which of all endless terrains this is (32 bits).

    unit: of lengths, for people. level_pixels: mean standard deviation of a level in pixels where it takes over from
    its finer neighbour. band: half the width of that fade, as a share of the distance. floor_pixels: width of a finest
    disc in the nearest ground that the lowest eye sees. decibels: PSNR from which drawing in a neighbour's order is not
    seen. threads: that sort tiles; they change no byte. sky: sRGB colours behind everything.
    """

    tau: float
    salt: int = 0
    unit: str = "metre"
    level_pixels: float = 1.0
    band: float = 0.1
    floor_pixels: float = 12.0
    decibels: float = 40.0
    threads: int = 1
    sky: dict = field(default_factory=lambda: {"zenith": [0.36, 0.55, 0.8], "horizon": [0.78, 0.84, 0.88]})


def write_bundle(
    tiles: TileSet, out_dir: Path | str, options: BundleOptions, schema: Path | str, provenance: dict
) -> dict:
    """Write davgswt.json, chunks/ and gswt.zip to a folder; returns the manifest.

    schema: workflow/schemas/davgswt.schema.json. Everything is made beside the folder and moved in when it is whole,
    the manifest last: whoever finds a manifest finds all that it names. Other entries of the folder stay.
    Raises: InputError: mean scales that do not rise, an empty tile, too many splats; see lod, gswt, manifest.
    """
    out = Path(out_dir)
    part = out.with_name(f".{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    (part / "chunks").mkdir(parents=True)
    try:
        gswt.write_gswt(tiles.fields, tiles.side, part / "gswt.zip")
        climbed = direction_search.search_directions(tiles.fields[0], tiles.side, options.decibels)
        value = describe_tiles(tiles, options, climbed.rings)
        pixel = tiles.spacing / options.floor_pixels
        encoding = Encoding.fit([f for level in tiles.fields for f in level], tiles.side, pixel)
        errors = _write_chunks(tiles, encoding, value, options, part)
        value |= {
            "format": manifest.FORMAT,
            "version": manifest.VERSION,
            "unit": options.unit,
            "sky": options.sky,
            "encoding": encoding.to_dict() | {"sh_degree": 0},
            "error": asdict(errors) | {f"{k}_db": v for k, v in _measure_rounding(tiles, encoding, pixel).items()},
            "orders": _describe_orders(climbed, options),
            "provenance": provenance,
        }
        manifest.check_manifest(value, schema)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return value


def describe_tiles(tiles: TileSet, options: BundleOptions, rings: orders.DirectionRings) -> dict:
    """What of a manifest says how its tiles are laid and drawn: all that `terrain.assemble.of_fields` reads.

    Raises: InputError: mean scales that do not rise, an empty tile.
    """
    table = level_distances.compute_levels(
        [mean_scale(level) for level in tiles.fields], options.level_pixels, options.band
    )
    listed = []
    for tile, doubt in enumerate(np.clip(tiles.uncertainty, 0, 1).tolist()):
        reach = [measure_heights(fields[tile]) for fields in tiles.fields]
        heights = [min(low for low, _ in reach), max(high for _, high in reach)]
        kept = rings.select(doubt, options.tau)
        chunks_of = [{"level": level, "orders": kept} for level in range(len(tiles.fields))]
        listed.append({"tile": tile, "uncertainty": doubt, "z": heights, "chunks": chunks_of})
    return {
        "tile_side": tiles.side,
        "salt": options.salt,
        "eye_floor": level_distances.compute_eye_floor(tiles.spacing, options.floor_pixels),
        "ground_colour": _compute_ground_colour(tiles.fields[-1]),
        "directions": rings.directions().tolist(),
        "levels": table,
        "tiles": listed,
    }


def _write_chunks(
    tiles: TileSet, encoding: Encoding, value: dict, options: BundleOptions, part: Path
) -> EncodingErrors:
    """Write the chunks and say of their files in the manifest; by how much their Gaussians are wrong at most."""
    along, errors, pixel = np.array(value["directions"]), EncodingErrors(), tiles.spacing / options.floor_pixels

    def write(place: tuple[dict, dict]) -> EncodingErrors:
        tile, entry = place[0]["tile"], place[1]
        source, name = tiles.fields[entry["level"]][tile], f"chunks/lod{entry['level']}_tile_{tile:02d}.bin"
        rows, order = encoding.encode(source), orders.presort(source.means, along[entry["orders"]])
        entry |= {"file": name} | chunks.write_chunk(rows, order, part / name)
        return EncodingErrors.measure(encoding, source, rows, pixel)

    places = [(tile, entry) for tile in value["tiles"] for entry in tile["chunks"]]
    with ThreadPoolExecutor(options.threads) as pool:
        for _, more in zip(progress(places, "sort tiles"), pool.map(write, places), strict=True):
            errors = errors.joined(more)
    return errors


def _measure_rounding(tiles: TileSet, encoding: Encoding, pixel: float) -> dict[str, float | None]:
    """By elevation, the PSNR of rounded tiles against tiles, both as near as the lowest eye sees them."""
    found = {}
    for view, down in order_directions.ELEVATIONS.items():
        pairs = []
        for sight in order_directions.spread_views(len(tiles.labels), down):
            source = tiles.fields[0][sight.tile]
            pair = (encoding.decode(encoding.encode(source)), source)
            pairs.append(tuple(order_directions.render_in_order(f, tiles.side, sight.direction, pixel) for f in pair))
        found[view] = order_directions.compute_psnr(pairs)
    return found


def _describe_orders(climbed: DirectionSearchResult, options: BundleOptions) -> dict:
    rings = {"elevations": list(climbed.rings.elevations), "azimuths": climbed.rings.azimuths, "tau": options.tau}
    return rings | {"wanted_db": options.decibels} | {f"{view}_db": v for view, v in climbed.decibels.items()}


def measure_heights(field: GaussianField) -> tuple[float, float]:
    """Lowest and highest z of the splats, three of their largest standard deviations around the centres included."""
    if not len(field):
        raise InputError("a tile has no splat; the field has a hole as wide as a tile")
    z, reach = field.means[:, 2].astype(float), 3 * np.exp(field.log_scales.astype(float).max(1))
    return float((z - reach).min()), float((z + reach).max())


def _compute_ground_colour(fields: list[GaussianField]) -> list[float]:
    """What the terrain looks like from very far: the mean ground colour (of all splats where none is
    ground).
    """
    ground = [f.base_colours[f.ground] for f in fields if f.ground.any()] or [f.base_colours for f in fields]
    return np.clip(np.concatenate(ground).astype(float).mean(0), 0, 1).tolist()


def _move_in(part: Path, out: Path) -> None:
    """Replace what a bundle owns in `out`; without a manifest it counts as absent, so it goes first and comes last."""
    out.mkdir(parents=True, exist_ok=True)
    (out / manifest.NAME).unlink(missing_ok=True)
    shutil.rmtree(out / "chunks", ignore_errors=True)
    for name in ("chunks", "gswt.zip", manifest.NAME):
        (part / name).replace(out / name)
