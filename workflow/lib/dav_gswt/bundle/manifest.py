"""davgswt.json: the manifest of a bundle, the only contract between the pipeline and a viewer.

The classes here are the JSON objects of the file, with the same keys in the same order. The JSON schema
(workflow/schemas/davgswt.schema.json) checks types and bounds, on writing and on reading; `check_manifest` also
checks what belongs together. All lengths are in the bundle's unit, z is up, and x, y of a tile count from its
south-western corner.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from dav_gswt.bundle.chunks import ChunkEntry, ChunkOrders, chunk_size
from dav_gswt.bundle.encoding import POSITION_STEPS, SCALE_STEPS, Encoding, EncodingErrors
from dav_gswt.bundle.land_cover import ClassesEntry, ObjectEntry, ObjectOrders, ScatterEntry
from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import parse_record, read_json

NAME = "davgswt.json"
FORMAT, VERSION = "davgswt", 3
READABLE = (2, VERSION)  # version 2 has one material, which it does not name
ONLY_MATERIAL = "ground"  # the name of the material of a set that has one
MAX_BYTES = 1 << 26  # of a manifest
FARTHEST, MAX_LOG_SCALE = 1e9, 60.0  # of lengths, whose squares single precision keeps; of logarithms of deviations


@dataclass(frozen=True)
class Sky:
    """sRGB colours, in [0, 1], of the sky straight up and at the horizon."""

    zenith: list[float] = field(default_factory=lambda: [0.36, 0.55, 0.8])
    horizon: list[float] = field(default_factory=lambda: [0.78, 0.84, 0.88])


@dataclass(frozen=True)
class LevelEntry:
    """One level of detail.

    Attributes:
        level: its number; 0 is the finest.
        mean_scale: mean standard deviation of its Gaussians.
        distance: from the eye, where it gives way to the next level; None for the last level.
        band: half the width of the cross-fade about `distance`.
    """

    level: int
    mean_scale: float
    distance: float | None
    band: float


@dataclass(frozen=True)
class TileOrders:
    """One tile: its number 16 c + 8 W + 4 N + 2 E + S of variant c and the colours of its edges, its mean uncertainty
    in [0, 1], the lowest and highest z of its Gaussians, and the orders of its chunks, one a level.
    """

    tile: int
    uncertainty: float
    z: list[float]
    chunks: Sequence[ChunkOrders]


@dataclass(frozen=True)
class TileEntry(TileOrders):
    """A tile whose chunks are files."""

    chunks: Sequence[ChunkEntry]


@dataclass(frozen=True)
class MaterialEntry:
    """A material: its name, its share of the ground, the number of its first tile and its mean sRGB colour.

    Its tile T has the number first_tile + T, with T = 16 c + 8 W + 4 N + 2 E + S; all materials have as many tiles.
    """

    name: str
    share: float
    first_tile: int
    ground_colour: list[float]


@dataclass(frozen=True)
class TileSetInfo:
    """How a tile set is placed and drawn: all that a terrain needs beside the Gaussians.

    Attributes:
        tile_side: width of a tile.
        salt: which of all endless terrains this is, 32 bits.
        eye_floor: lowest sensible height of the eye above the ground.
        ground_colour: mean sRGB colour of the ground, beyond the last tiles.
        directions: unit vectors of viewing directions that tiles keep orders for.
        levels: finest first.
        tiles: by number, those of the first material first.
        materials: at least one.
        classes: which material lies where; None with one material.
        objects: on the tiles; None without.
        scatter: where objects stand; None without objects.
    """

    tile_side: float
    salt: int
    eye_floor: float
    ground_colour: list[float]
    directions: list[list[float]]
    levels: list[LevelEntry]
    tiles: Sequence[TileOrders]
    materials: list[MaterialEntry]
    _: KW_ONLY
    classes: ClassesEntry | None = None
    objects: Sequence[ObjectOrders] | None = None
    scatter: ScatterEntry | None = None


@dataclass(frozen=True)
class RoundingErrors(EncodingErrors):
    """Largest errors of the records, and the PSNR of pictures of rounded tiles, seen by a walker and from 45 degrees;
    None: no difference.
    """

    walker_db: float | None = None
    oblique_db: float | None = None


@dataclass(frozen=True)
class OrdersReport:
    """Rings of directions: elevations in degrees below the horizon, azimuths of a ring, the tau from which a tile keeps
    all of them, the PSNR that was asked for, and the PSNR of pictures drawn in a neighbour's order (None: no
    difference).
    """

    elevations: list[float]
    azimuths: int
    tau: float
    wanted_db: float
    walker_db: float | None
    oblique_db: float | None


@dataclass(frozen=True)
class Manifest(TileSetInfo):
    """davgswt.json.

    Attributes:
        format, version: FORMAT and VERSION.
        unit: of lengths, for display.
        sky: behind everything.
        encoding: how the records of all chunks are read.
        error: what rounding to records costs.
        orders: how the directions were found.
        provenance: of the files that the bundle was made from.
        heights: of the surface under the tiles; only in the manifest of a page.
    """

    tiles: Sequence[TileEntry]
    objects: Sequence[ObjectEntry] | None = field(default=None, kw_only=True)
    format: str
    version: int
    unit: str
    sky: Sky
    encoding: Encoding
    error: RoundingErrors
    orders: OrdersReport
    provenance: dict[str, Any]
    heights: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """The JSON object."""
        value = asdict(self)
        for key in ("classes", "objects", "scatter", "heights"):
            if value[key] is None:
                del value[key]
        if "classes" in value and not value["classes"]["painted"]:
            del value["classes"]["painted"]
        return value

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "Manifest":
        """The manifest of a JSON object. Raises: ValueError: not one that `check_manifest` has passed."""
        return parse_record(value, cls)


def check_manifest(value: Any, schema: Path | str, name: Path | str = NAME) -> None:
    """Check a manifest's JSON object against the JSON schema and its tables against one another.

    Raises: InputError: the key and what is wrong with it.
    """
    rules = json.loads(Path(schema).read_text(encoding="utf-8"))
    # the first error alone: a later keyword may take hours on what an earlier one refuses
    if error := best_match(islice(Draft202012Validator(rules).iter_errors(value), 1)):
        key = ".".join(str(p) for p in error.absolute_path)[:80] or "manifest"
        raise InputError(f"{name}: {key}: {summarize_error(error.message)}; make the bundle again")
    try:
        manifest = Manifest.from_dict(value)
    except ValueError as error:
        raise InputError(f"{name}: {summarize_error(error)}; make the bundle again") from error
    for fault in _find_faults(manifest):
        raise InputError(f"{name}: {fault}; make the bundle again")


def _find_faults(manifest: Manifest) -> Iterator[str]:
    """What the schema cannot express."""
    levels, tiles, objects = manifest.levels, manifest.tiles, manifest.objects or []
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
    named = [(f"tile {t.tile}", t.chunks) for t in tiles] + [(f"object {k}", o.chunks) for k, o in enumerate(objects)]
    for name, chunks in named:
        if [chunk.level for chunk in chunks] != list(range(len(levels))):
            yield f"{name}: one chunk a level is needed, in order"
        for chunk in chunks:
            if chunk.bytes != chunk_size(chunk.count, len(chunk.orders)):
                yield f"{chunk.file}: bytes do not fit count and orders"
            if max(chunk.orders) >= len(manifest.directions):
                yield f"{chunk.file}: an order of a direction that is not there"


def _find_wrong_lengths(manifest: Manifest) -> Iterator[str]:
    levels, encoding, objects = manifest.levels, manifest.encoding, manifest.objects or []
    lengths = [manifest.tile_side, manifest.eye_floor, *(level.mean_scale for level in levels)]
    lengths += [v for level in levels for v in (level.distance or 0.0, level.band)]
    lengths += [*encoding.origin, *(POSITION_STEPS * step for step in encoding.step)]
    lengths += [z for part in (manifest.tiles, objects) for each in part for z in each.z]
    lengths += [each.radius for each in objects]
    if not max(map(abs, lengths)) <= FARTHEST:
        yield f"a length is beyond {FARTHEST:g}"
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
    if any(each.material >= count for each in objects):
        yield "objects: one stands on a material that is not there"
    for fault in manifest.classes.find_faults(count) if manifest.classes else []:
        yield f"classes: {fault}"


def upgrade_manifest(value: dict[str, Any]) -> dict[str, Any]:
    """A manifest of version 2 as one of version 3: with its only material."""
    if value.get("version") != 2:
        return value
    ground = {"name": ONLY_MATERIAL, "share": 1.0, "first_tile": 0, "ground_colour": value.get("ground_colour")}
    return value | {"version": VERSION, "materials": [ground]}


def read_manifest(folder: Path | str, schema: Path | str) -> Manifest:
    """Read and check a bundle's manifest.

    Raises: InputError: missing, too large, no JSON, of another format or version, or see `check_manifest`.
    """
    path = Path(folder) / NAME
    if path.is_file() and path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: {path.stat().st_size} bytes are no manifest; make the bundle again")
    value = read_json(path)
    if not isinstance(value, dict) or value.get("format") != FORMAT or value.get("version") not in READABLE:
        raise InputError(f"{path}: not a bundle of format {FORMAT!r}, version {VERSION}; make the bundle again")
    value = upgrade_manifest(value)
    check_manifest(value, schema, path)
    return Manifest.from_dict(value)
