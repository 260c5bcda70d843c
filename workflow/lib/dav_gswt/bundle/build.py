"""A bundle from a tile set: chunks, zip and manifest, which appear together or not at all."""

import shutil
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dav_gswt.bundle import chunks, gswt, lod, manifest, orders
from dav_gswt.errors import InputError
from dav_gswt.field import Field, mean_scale
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.tiles.build import TileSet


@dataclass(frozen=True)
class Options:
    """tau: from which mean uncertainty on a tile is deep. salt: which of all endless terrains this is (32 bits).

    unit: of lengths, for people. level_pixels: mean standard deviation of a level in pixels where it takes over from
    its finer neighbour. band: half the width of that fade, as a share of the distance. floor_pixels: width of a finest
    disc in the nearest ground that the lowest eye sees. sky: sRGB colours behind everything.
    """

    tau: float
    salt: int = 0
    unit: str = "metre"
    level_pixels: float = 1.0
    band: float = 0.1
    floor_pixels: float = 12.0
    sky: dict = field(default_factory=lambda: {"zenith": [0.36, 0.55, 0.8], "horizon": [0.78, 0.84, 0.88]})


def write_bundle(tiles: TileSet, out_dir: Path | str, options: Options, schema: Path | str, provenance: dict) -> dict:
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
        table = lod.level_table([mean_scale(level) for level in tiles.fields], options.level_pixels, options.band)
        gswt.write(tiles.fields, tiles.side, part / "gswt.zip")
        value = {
            "format": "davgswt",
            "version": 1,
            "unit": options.unit,
            "tile_side": tiles.side,
            "salt": options.salt,
            "eye_floor": lod.eye_floor(tiles.spacing, options.floor_pixels),
            "ground_colour": _mean_colour(tiles.fields[-1]),
            "sky": options.sky,
            "directions": orders.directions().tolist(),
            "levels": table,
            "tiles": [_tile(tiles, t, options.tau, part) for t in progress(range(len(tiles.labels)), "sort tiles")],
            "provenance": provenance,
        }
        manifest.check(value, schema)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return value


def _tile(tiles: TileSet, tile: int, tau: float, part: Path) -> dict:
    doubt = float(np.clip(tiles.uncertainty[tile], 0, 1))
    kept = orders.kept(doubt, tau)
    found = []
    for level, fields in enumerate(tiles.fields):
        name = f"chunks/lod{level}_tile_{tile:02d}.bin"
        found.append({"level": level, "file": name} | chunks.write(fields[tile], kept, part / name))
    reach = [heights_of(fields[tile]) for fields in tiles.fields]
    low, high = min(r[0] for r in reach), max(r[1] for r in reach)
    return {"tile": tile, "uncertainty": doubt, "z": [low, high], "chunks": found}


def heights_of(field: Field) -> tuple[float, float]:
    """Lowest and highest z of the splats, three of their largest standard deviations around the centres included."""
    if not len(field):
        raise InputError("a tile has no splat; the field has a hole as wide as a tile")
    z, reach = field.means[:, 2].astype(float), 3 * np.exp(field.log_scales.astype(float).max(1))
    return float((z - reach).min()), float((z + reach).max())


def _mean_colour(fields: list[Field]) -> list[float]:
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
