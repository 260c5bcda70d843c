"""Make a bundle of tiles and objects: parts and manifest, which appear together or not at all."""

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dav_gswt.bundle import manifest, orders, parts, recipes
from dav_gswt.bundle.content import BundleContent, compute_ground_colour
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.bundle.land_cover import LightEntry, ObjectEntry
from dav_gswt.bundle.manifest import Manifest, MaterialEntry, Sky, TileEntry
from dav_gswt.bundle.parts import Block, ChunkEntry, PartEntry, pack_block, write_part
from dav_gswt.bundle.recipes import Composition
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.tiles.build import Recipe

FLOOR_PIXELS = 12.0  # width of a finest disc in the nearest ground that the lowest eye sees


@dataclass(frozen=True)
class BundleOptions:
    """How tiles are bundled.

    Attributes:
        tau: from this mean uncertainty on, a tile is drawn in the orders of all directions.
        salt: which of all endless terrains this is (32 bits).
        unit: of lengths, for display.
        level_pixels: mean standard deviation of a level, in pixels, where it takes over from its finer neighbour.
        band: half the width of that cross-fade, as a share of the distance.
        light: the captured sun; None: not known.
    """

    tau: float
    salt: int = 0
    unit: str = "metre"
    level_pixels: float = 1.0
    band: float = 0.1
    light: LightEntry | None = None


def write_bundle(
    content: BundleContent, out_dir: Path | str, options: BundleOptions, provenance: dict[str, Any]
) -> Manifest:
    """Write davgswt.json and parts/ to a folder; returns the manifest.

    Everything is made beside the folder and moved in when it is whole, the manifest last, so a manifest
    never names a file that is missing. Other entries of the folder stay.

    Raises: InputError: mean scales that do not rise, or an empty tile.
    """
    out = Path(out_dir)
    part = out.with_name(f".{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    (part / parts.FOLDER).mkdir(parents=True)
    try:
        made = _write_content(content, options, provenance, part)
        value = made.to_dict()
        Manifest.from_dict(value)
        write_json(part / manifest.NAME, value)
        _move_in(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return made


def _write_content(content: BundleContent, options: BundleOptions, provenance: dict[str, Any], part: Path) -> Manifest:
    """Write the parts; returns the manifest. Raises: InputError: mean scales that do not rise, an empty tile."""
    levels = [content.tile_fields(level) for level in range(content.levels)]
    tiles = list(zip(*levels, strict=True))
    heights = [_measure_heights(fields) for fields in tiles]
    uncertainties = [u for same in content.tiles for u in np.clip(same.uncertainty, 0, 1).tolist()]
    # the materials in turn: of what errors are measured on each has its share
    in_turn = [each for same in zip(*(own.fields[0] for own in content.tiles), strict=True) for each in same]
    rings = orders.search_directions(in_turn, content.side)
    table = manifest.compute_levels([mean_scale(f) for f in levels], options.level_pixels, options.band)
    objects = list(zip(*(content.object_fields(level) for level in range(content.levels)), strict=True))
    encoding, composition = _fit_grid(content, [field for fields in (*tiles, *objects) for field in fields])
    written, own, theirs = _write_parts(content, levels, objects, encoding, composition, part)
    count, things = len(content.tiles[0].labels), []
    for number, (each, probability) in enumerate(zip(content.objects, content.probabilities, strict=True)):
        ground, z = content.ground_height(each.material), _measure_heights(each.fields)
        kept = rings.select_directions(float(np.clip(each.fields[0].uncertainty.mean(), 0, 1)), options.tau)
        about = (each.name, each.radius, z, ground, each.material, each.density, probability)
        things.append(ObjectEntry(*about, kept, theirs[number]))
    return Manifest(
        tile_side=content.side,
        salt=options.salt,
        eye_floor=manifest.compute_eye_floor(content.spacing, FLOOR_PIXELS),
        ground_colour=content.ground_colour(),
        directions=rings.directions().tolist(),
        levels=table,
        tiles=[
            TileEntry(tile, u, z, rings.select_directions(u, options.tau), chunks)
            for tile, (u, z, chunks) in enumerate(zip(uncertainties, heights, own, strict=True))
        ],
        materials=[
            MaterialEntry(material.name, material.share, number * count, compute_ground_colour(same.fields[-1]))
            for number, (material, same) in enumerate(zip(content.materials, content.tiles, strict=True))
        ],
        classes=content.classes,
        objects=things or None,
        scatter=content.scatter,
        variation=content.variation,
        light=options.light,
        format=manifest.FORMAT,
        version=manifest.VERSION,
        unit=options.unit,
        sky=Sky(),
        encoding=encoding,
        parts=written,
        composition=composition,
        provenance=provenance,
    )


def _fit_grid(content: BundleContent, fields: list[GaussianField]) -> tuple[Encoding, Composition | None]:
    """The grid of all Gaussians, and what composed tiles have in common; None: all tiles are stored."""
    pixel, found = content.spacing / FLOOR_PIXELS, content.recipes
    if not found:
        return Encoding.fit(fields, content.side, pixel), None
    cells = content.tiles[0].layout.side
    encoding = Encoding.fit([*fields, *_move_exemplars(found)], content.side, pixel, cells)
    cell = round(content.side / encoding.step[0] / cells)
    exemplars = [recipe.levels[0].exemplar.cells for recipe in found]
    return encoding, Composition(cells, cell, len(found[0].levels), exemplars)


def _move_exemplars(recipes: Sequence[Recipe]) -> Iterable[GaussianField]:
    """The exemplars' Gaussians on the z axis: of what a grid holds of them only heights and sizes count."""
    for recipe in recipes:
        for level in recipe.levels:
            yield replace(level.field, means=level.field.means * np.array([0, 0, 1], np.float32))


def _write_parts(
    content: BundleContent,
    levels: Sequence[Sequence[GaussianField]],
    objects: Sequence[Sequence[GaussianField]],
    encoding: Encoding,
    composition: Composition | None,
    part: Path,
) -> tuple[list[PartEntry], list[list[ChunkEntry]], list[list[ChunkEntry]]]:
    """Write the parts in the order in which viewers fetch them: coarse before fine.

    levels: levels[level][tile]; objects: objects[number][level]. Returns: the parts, and the chunks of each tile and
    of each object.
    """
    written: list[PartEntry] = []
    composed = composition.levels if composition else 0
    own: list[list[ChunkEntry]] = [[] for _ in levels[0]]
    theirs: list[list[ChunkEntry]] = [[] for _ in objects]

    def store(fields: Sequence[tuple[list[ChunkEntry], int, GaussianField]], name: str) -> None:
        first = 0
        for chunks, level, field in fields:
            chunks.append(ChunkEntry(level, len(field), len(written), first))
            first += len(field)
        rows = np.concatenate([encoding.encode(field) for _, _, field in fields])
        rows["rotation"] = recipes.coarsen_rotation(rows["rotation"])
        written.append(write_part(pack_block(Block.from_records(rows)), part, parts.RECORDS, name))

    def store_level(level: int) -> None:
        fields = [(chunks, level, field) for chunks, field in zip(own, levels[level], strict=True)]
        store(fields, f"records{level}")

    def store_composed(level: int) -> None:
        for chunks, field in zip(own, levels[level], strict=True):
            chunks.append(ChunkEntry(level, len(field)))
        assert composition is not None
        data = recipes.pack_level(content.tiles, content.recipes, level, encoding, composition.cell)
        written.append(write_part(data, part, parts.LEVEL, f"level{level}", level))

    coarse = range(composed, len(levels))
    if composed and coarse:
        fields = [(chunks, k, levels[k][tile]) for tile, chunks in enumerate(own) for k in coarse]
        things = zip(theirs, objects, strict=True)
        store([*fields, *((chunks, k, each[k]) for chunks, each in things for k in coarse)], "records")
    for level in progress(range(len(levels) - 1, -1, -1), "write parts"):
        if level == 0 and objects:
            things = zip(theirs, objects, strict=True)
            rest = range(composed or len(levels))
            store([(chunks, k, each[k]) for chunks, each in things for k in rest], "objects")
        if composed and level == composed - 1:
            data = recipes.pack_recipes(content.tiles, content.recipes, encoding)
            written.append(write_part(data, part, parts.RECIPES, "recipes"))
        if level < composed:
            store_composed(level)
        elif not composed:
            store_level(level)
    own, theirs = ([sorted(each, key=lambda chunk: chunk.level) for each in chunks] for chunks in (own, theirs))
    return written, own, theirs


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
    shutil.rmtree(out / parts.FOLDER, ignore_errors=True)
    for name in (parts.FOLDER, manifest.NAME):
        (part / name).replace(out / name)
