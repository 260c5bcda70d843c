"""davgswt.json: the manifest of a bundle, the only contract between the pipeline and a viewer.

The classes here are the JSON objects of the file, with the same keys in the same order; their docstrings
say what each key means, and docs/formats.md how the keys work together. The types hold the bounds of the values.
`Manifest.from_dict` checks them and what belongs together, and workflow/schemas/davgswt.schema.json is generated from
them. All lengths are in the bundle's unit, z is up, and x, y of a tile count from its south-western corner.

Two things follow from a splat's size in pixels: the distances at which levels change, and the least eye height. The
reference picture is 1920 pixels and 60 degrees wide, its focal length f = 960 / tan 30 degrees = 1663 pixels.
"""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, TypeAdapter

from dav_gswt.bundle.encoding import (
    POSITION_STEPS,
    RECORD,
    SCALE_STEPS,
    Colour,
    Encoding,
    Entry,
    Length,
    Natural,
    Pair,
    Share,
    Size,
)
from dav_gswt.bundle.land_cover import ClassesEntry, LightEntry, Name, ObjectEntry, Salt, ScatterEntry, WaveEntry
from dav_gswt.bundle.parts import LEVEL, MAX_SIZE, MAX_TOTAL, PLAIN, PLANES, RECIPES, RECORDS, ChunkEntry, PartEntry
from dav_gswt.bundle.recipes import Composition, locate_corner
from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import parse_record, read_json

NAME = "davgswt.json"
FORMAT, VERSION = "davgswt", 4
# keys that are left out for None
OPTIONAL = "classes", "objects", "scatter", "variation", "light", "wind", "composition", "heights"
ONLY_MATERIAL = "ground"  # the name of the material of a set that has one
MAX_BYTES = 1 << 26  # of a manifest
WHOLE = 1e-9  # error of whole numbers of steps, of their own size
FARTHEST, MAX_LOG_SCALE = 1e9, 60.0  # of lengths, whose squares single precision keeps; of logarithms of deviations


Direction = Annotated[list[Annotated[float, Field(ge=-1, le=1)]], Field(min_length=3, max_length=3)]
WIDTH, FOV = 1920, 60.0
FOCAL = 0.5 * WIDTH / np.tan(np.radians(FOV / 2))  # pixels
ASPECT = 9 / 16


@dataclass(frozen=True)
class Sky(Entry):
    """The colours of the sky, sRGB from 0 to 1.

    Attributes:
        zenith: colour straight up.
        horizon: colour at the horizon.
    """

    zenith: Colour = field(default_factory=lambda: [0.36, 0.55, 0.8])
    horizon: Colour = field(default_factory=lambda: [0.78, 0.84, 0.88])


@dataclass(frozen=True)
class LevelEntry(Entry):
    """One level of detail.

    Attributes:
        level: index, from 0, the finest level.
        mean_scale: mean standard deviation of the level's Gaussians. It rises from level to level.
        distance: distance from the eye at which the next level takes over. It rises from level to level and is null for
            the last one.
        band: half the length over which this level fades into the next; 0 for the last level.
    """

    level: Natural
    mean_scale: Length
    distance: Length | None
    band: Size


@dataclass(frozen=True)
class TileEntry(Entry):
    """One tile of a material.

    Attributes:
        tile: index, from 0.
        uncertainty: mean uncertainty of the ground that the tile shows, from 0 (certain) to 1.
        z: lowest and highest z of the tile's Gaussians at any level, out to three standard deviations.
        orders: the draw orders to use, as different indices into `directions`.
        chunks: one chunk for each level, finest first.
    """

    tile: Natural
    uncertainty: Share
    z: Pair
    orders: Annotated[list[Natural], Field(min_length=1)]
    chunks: Annotated[Sequence[ChunkEntry], Field(min_length=1)]


@dataclass(frozen=True)
class MaterialEntry(Entry):
    """A kind of ground. All materials have the same number of tiles.

    Attributes:
        name: name of the material.
        share: share of the ground that it covers.
        first_tile: index of its first tile. Its tile with variant c and edge colours W, N, E and S has the index
            first_tile + 16 c + 8 W + 4 N + 2 E + S.
        ground_colour: mean colour of its ground.
    """

    name: Name
    share: Share
    first_tile: Natural
    ground_colour: Colour


@dataclass(frozen=True, kw_only=True)
class Manifest(Entry):
    """davgswt.json, the manifest of a bundle.

    Attributes:
        tile_side: length of a tile's side.
        salt: input of all hashes that choose tiles.
        eye_floor: lowest height of the eye above the ground at which the ground looks sharp.
        ground_colour: mean colour of the ground, which a viewer draws beyond the last tile.
        directions: unit vectors from the eye into the scene, for which tiles are sorted. The last is straight down.
        levels: levels of detail, finest first.
        tiles: the tiles of all materials, one material after the other.
        materials: kinds of ground.
        classes: which material lies where. Present if and only if there are several materials.
        objects: things that stand on the tiles.
        scatter: where objects stand. Present if and only if there are objects.
        variation: waves that add large-scale light and dark to the ground.
        light: position of the captured sun, whose light the colours contain.
        wind: how far plants sway on a page.
        format: always `davgswt`.
        version: version of the format. A reader must refuse other versions.
        unit: name of the unit of length, for display.
        sky: colours of the sky.
        encoding: how to decode records.
        parts: the files, in the order in which a viewer should fetch them.
        provenance: version, settings and digests of all inputs.
        composition: numbers that all composed tiles share. Missing if no level is composed.
        heights: the surface on which the tiles lie. Only in the manifest of a page.
    """

    tile_side: Length
    salt: Salt
    eye_floor: Length
    ground_colour: Colour
    directions: Annotated[list[Direction], Field(min_length=1)]
    levels: Annotated[list[LevelEntry], Field(min_length=1, max_length=16)]
    tiles: Annotated[Sequence[TileEntry], Field(min_length=16)]
    materials: Annotated[list[MaterialEntry], Field(min_length=1, max_length=8)]
    classes: ClassesEntry | None = None
    objects: Annotated[Sequence[ObjectEntry], Field(min_length=1, max_length=256)] | None = None
    scatter: ScatterEntry | None = None
    variation: Annotated[list[WaveEntry], Field(min_length=1, max_length=3)] | None = None
    light: LightEntry | None = None
    wind: Annotated[float, Field(ge=0, le=4)] | None = None
    format: Literal["davgswt"]
    version: Literal[4]
    unit: Annotated[str, Field(min_length=1)]
    sky: Sky
    encoding: Encoding
    parts: Annotated[list[PartEntry], Field(min_length=1, max_length=1024)]
    provenance: dict[str, Any]
    composition: Composition | None = None
    heights: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """The JSON object."""
        value = asdict(self)
        entries = [chunk for each in (*value["tiles"], *(value["objects"] or [])) for chunk in each["chunks"]]
        for entry in (value, *value["parts"], *entries):
            for key in (*OPTIONAL, "level", "part", "first"):
                if key in entry and entry[key] is None:
                    del entry[key]
        if "classes" in value and not value["classes"]["painted"]:
            del value["classes"]["painted"]
        return value

    @classmethod
    def from_dict(cls, value: Any, name: Path | str = NAME) -> "Manifest":
        """The manifest of a JSON object. Raises: InputError: the key and what is wrong with it; name: of the file."""
        try:
            manifest = parse_record(value, cls)
        except ValueError as error:
            raise InputError(f"{name}: {summarize_error(error)}; make the bundle again") from error
        for fault in _find_faults(manifest):
            raise InputError(f"{name}: {fault}; make the bundle again")
        return manifest


def make_schema() -> str:
    """The JSON schema of a manifest: workflow/schemas/davgswt.schema.json."""
    schema = TypeAdapter(Manifest).json_schema()
    for entry in (schema, *schema["$defs"].values()):
        _describe_keys(entry)
    return json.dumps(schema, indent=1) + "\n"


def _describe_keys(entry: dict[str, Any]) -> None:
    """Give each key of an object the description that the object has of it under `Attributes:`."""
    entry["description"], _, attributes = entry["description"].partition("\n\nAttributes:\n")
    for names, text in re.findall(r"^ {4}(\w+(?:, \w+)*): (.*(?:\n {5,}.*)*)", attributes, re.M):
        text = " ".join(text.split())
        for name in names.split(", "):
            entry["properties"][name]["description"] = text[:1].upper() + text[1:]


def _find_faults(manifest: Manifest) -> Iterator[str]:
    """What contradicts itself: the types of single values cannot express it."""
    levels, tiles = manifest.levels, manifest.tiles
    yield from _find_wrong_lengths(manifest)
    if [level.level for level in levels] != list(range(len(levels))):
        yield "levels must count up from 0"
    distances = [level.distance for level in levels]
    known = [distance for distance in distances[:-1] if distance is not None]
    if len(known) < len(levels) - 1 or distances[-1] is not None or known != sorted(set(known)):
        yield "levels: distances must rise, and only the last is null"
    if any(b.mean_scale <= a.mean_scale for a, b in zip(levels, levels[1:], strict=False)):
        yield "levels: mean_scale must strictly rise"
    if [tile.tile for tile in tiles] != list(range(len(tiles))) or len(tiles) % (16 * len(manifest.materials)):
        yield f"{len(tiles)} tiles: they must be 0 to 16 C - 1 for each material, in order"
    yield from _find_wrong_cover(manifest)
    yield from _find_wrong_parts(manifest)


def _find_wrong_parts(manifest: Manifest) -> Iterator[str]:
    """What contradicts itself in parts, composition, chunks and orders."""
    parts, composed, levels = manifest.parts, manifest.composition, len(manifest.levels)
    if len({part.file for part in parts}) < len(parts):
        yield "parts: a file is there twice"
    if any((part.level is not None) != (part.kind == LEVEL) for part in parts):
        yield "parts: those of a level have a level, and only those"
    if any(part.kind == PLAIN and part.size != part.bytes for part in parts):
        yield "parts: size and bytes of a plain one differ"
    if sum(part.size for part in parts) > MAX_SIZE:
        yield f"parts: more than {MAX_SIZE} bytes"
    if sum(chunk.count for each in (*manifest.tiles, *(manifest.objects or [])) for chunk in each.chunks) > MAX_TOTAL:
        yield f"chunks: more than {MAX_TOTAL} splats"
    if composed:
        yield from _find_wrong_composition(manifest, composed)
    for name, orders, chunks, own in [
        *((f"tile {t.tile}", t.orders, t.chunks, composed.levels if composed else 0) for t in manifest.tiles),
        *((f"object {k}", o.orders, o.chunks, 0) for k, o in enumerate(manifest.objects or [])),
    ]:
        if [chunk.level for chunk in chunks] != list(range(levels)):
            yield f"{name}: one chunk a level is needed, in order"
        if len(set(orders)) < len(orders) or max(orders) >= len(manifest.directions):
            yield f"{name}: an order is there twice, or of a direction that is not there"
        for level, chunk in enumerate(chunks):
            if (chunk.part is None or chunk.first is None) != (level < own):
                yield f"{name}: level {level} is neither composed nor stored"
            elif chunk.part is not None and chunk.first is not None:
                part = parts[chunk.part] if chunk.part < len(parts) else None
                width = {RECORDS: PLANES, PLAIN: RECORD.itemsize}.get(part.kind) if part else None
                if part is None or width is None or (chunk.first + chunk.count) * width > part.size:
                    yield f"{name}: the records of level {level} are not there"


def _find_wrong_composition(manifest: Manifest, composed: Composition) -> Iterator[str]:
    levels, encoding = [part.level for part in manifest.parts if part.kind == LEVEL], manifest.encoding
    if composed.levels > len(manifest.levels) or composed.side % (1 << composed.levels - 1):
        yield "composition: levels do not fit the tiles"
    if sorted(level for level in levels if level is not None) != list(range(composed.levels)):
        yield "parts: one of each composed level is needed"
    if [part.kind for part in manifest.parts].count(RECIPES) != 1 or len(composed.exemplars) != len(manifest.materials):
        yield "composition: recipes or exemplars are missing"
    for part in manifest.parts:
        if part.kind == RECIPES and part.size != composed.recipes_size(len(manifest.tiles)):
            yield f"{part.file}: size does not fit the tiles"
    steps = composed.side * composed.cell
    if any(abs(steps * step - manifest.tile_side) > WHOLE * manifest.tile_side for step in encoding.step[:2]):
        yield "composition: a cell is not a whole number of steps"
        return
    corner = locate_corner(encoding)
    places = [-at / step for at, step in zip(encoding.origin[:2], encoding.step[:2], strict=True)]
    if any(abs(place - whole) > WHOLE * max(1, abs(place)) for place, whole in zip(places, corner, strict=True)):
        yield "composition: a tile does not begin at a step of the grid"
    if not all(c >= 0 and c + steps <= POSITION_STEPS for c in corner):
        yield "composition: a tile does not fit the grid"


def _find_wrong_lengths(manifest: Manifest) -> Iterator[str]:
    levels, encoding, objects = manifest.levels, manifest.encoding, manifest.objects or []
    lengths = [manifest.tile_side, manifest.eye_floor, *(level.mean_scale for level in levels)]
    lengths += [v for level in levels for v in (level.distance or 0.0, level.band)]
    lengths += [*encoding.origin, *(POSITION_STEPS * step for step in encoding.step)]
    lengths += [z for part in (manifest.tiles, objects) for each in part for z in each.z]
    lengths += [each.radius for each in objects]
    if not max(map(abs, lengths)) <= FARTHEST or manifest.tile_side < 1 / FARTHEST:
        yield f"a length is beyond {FARTHEST:g}, or tile_side below {1 / FARTHEST:g}"
    widest = encoding.log_scale[0] + SCALE_STEPS * encoding.log_scale[1]
    if not max(abs(encoding.log_scale[0]), abs(widest)) <= MAX_LOG_SCALE:
        yield "encoding: log_scale makes no sense"


def _find_wrong_cover(manifest: Manifest) -> Iterator[str]:
    """What contradicts itself in materials, classes and objects."""
    count, objects = len(manifest.materials), manifest.objects or []
    each = len(manifest.tiles) // count
    if [material.first_tile for material in manifest.materials] != list(range(0, count * each, max(each, 1))):
        yield f"materials: the first tiles of {count} materials must be {each} apart"
    if (manifest.classes is None) != (count == 1):
        yield "classes: needed with several materials, and only then"
    if (manifest.scatter is None) != (not objects):
        yield "scatter: needed with objects, and only then"
    if any(len(wave.colours) != count for wave in manifest.variation or []):
        yield f"variation: a wave does not have a colour for each of {count} materials"
    if any(each.material >= count for each in objects):
        yield "objects: one stands on a material that is not there"
    for fault in manifest.classes.find_faults(count) if manifest.classes else []:
        yield f"classes: {fault}"


def read_manifest(folder: Path | str) -> Manifest:
    """Read and check a bundle's manifest.

    Raises: InputError: missing, too large, no JSON, of another format or version, or see `Manifest.from_dict`.
    """
    path = Path(folder) / NAME
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: no file; make the bundle again")
    if path.is_file() and path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: {path.stat().st_size} bytes are no manifest; make the bundle again")
    value = read_json(path)
    if not isinstance(value, dict) or value.get("format") != FORMAT or value.get("version") != VERSION:
        raise InputError(f"{path}: not a bundle of format {FORMAT!r}, version {VERSION}; make the bundle again")
    return Manifest.from_dict(value, path)


def compute_levels(scales: list[float], pixels: float, band: float) -> list[LevelEntry]:
    """The manifest's levels from their mean scales, finest first.

    Level l gives way to l + 1 at the distance D_l = scale_{l+1} f / pixels, where the coarser one's mean standard
    deviation covers `pixels`; it fades over D_l -+ band D_l. The last level goes on without end (D null, band 0).
    Raises: InputError: the mean scale does not strictly rise.
    """
    for level, (fine, coarse) in enumerate(zip(scales, scales[1:], strict=False)):
        if not coarse > fine:
            raise InputError(
                f"level {level + 1}: mean scale {coarse:.6g} does not rise above level {level}'s {fine:.6g}; "
                "ask for fewer levels"
            )
    distances = [float(scale * FOCAL / pixels) for scale in scales[1:]]
    table = [
        LevelEntry(level, scale, far, band * far)
        for level, (scale, far) in enumerate(zip(scales, distances, strict=False))
    ]
    return [*table, LevelEntry(len(scales) - 1, scales[-1], None, 0.0)]


def compute_eye_floor(spacing: float, pixels: float, pitch: float = 30.0) -> float:
    """Lowest sensible eye height: the nearest visible ground then shows a finest disc `pixels` wide.

    Looking `pitch` degrees down, the picture's lower edge looks v further, tan v = 9/16 tan 30. A disc `spacing` wide
    covers f spacing / z pixels at the depth z, and the ground there lies at z = h cos v / sin(pitch + v).
    """
    v = np.arctan(ASPECT * np.tan(np.radians(FOV / 2)))
    depth = spacing * FOCAL / pixels
    return float(depth / np.cos(v) * np.sin(np.radians(pitch) + v))
