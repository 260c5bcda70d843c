"""davgswt.json: the manifest of a bundle, the only contract between the pipeline and a viewer.

The classes here are the JSON objects of the file, with the same keys in the same order. The JSON schema
(workflow/schemas/davgswt.schema.json) checks types and bounds, on writing and on reading; `check_manifest` also
checks what belongs together. All lengths are in the bundle's unit, z is up, and x, y of a tile count from its
south-western corner.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from dav_gswt.bundle.chunks import ChunkEntry, ChunkOrders, chunk_size
from dav_gswt.bundle.encoding import Encoding, EncodingErrors
from dav_gswt.errors import InputError
from dav_gswt.files import read_json

NAME = "davgswt.json"
FORMAT, VERSION = "davgswt", 2
MAX_BYTES = 1 << 26  # of a manifest


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
class TileSetInfo:
    """How a tile set is placed and drawn: all that a terrain needs beside the Gaussians.

    Attributes:
        tile_side: width of a tile.
        salt: which of all endless terrains this is, 32 bits.
        eye_floor: lowest sensible height of the eye above the ground.
        ground_colour: mean sRGB colour of the ground, beyond the last tiles.
        directions: unit vectors of viewing directions that tiles keep orders for.
        levels: finest first.
        tiles: by number.
    """

    tile_side: float
    salt: int
    eye_floor: float
    ground_colour: list[float]
    directions: list[list[float]]
    levels: list[LevelEntry]
    tiles: Sequence[TileOrders]


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
        unit: of lengths, for people.
        sky: behind everything.
        encoding: how the records of all chunks are read.
        error: what rounding to records costs.
        orders: how the directions were found.
        provenance: of the files that the bundle was made from.
        heights: of the surface under the tiles; only in the manifest of a page.
    """

    tiles: Sequence[TileEntry]
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
        if self.heights is None:
            del value["heights"]
        return value

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "Manifest":
        """The manifest of a JSON object that `check_manifest` has passed."""
        tiles = [TileEntry(**tile | {"chunks": [ChunkEntry(**c) for c in tile["chunks"]]}) for tile in value["tiles"]]
        parts = {
            "levels": [LevelEntry(**level) for level in value["levels"]],
            "tiles": tiles,
            "sky": Sky(**value["sky"]),
            "encoding": Encoding(**value["encoding"]),
            "error": RoundingErrors(**value["error"]),
            "orders": OrdersReport(**value["orders"]),
        }
        return cls(**value | parts)


def check_manifest(value: Any, schema: Path | str, name: Path | str = NAME) -> None:
    """Check a manifest's JSON object against the JSON schema and its tables against one another.

    Raises: InputError: the key and what is wrong with it.
    """
    rules = json.loads(Path(schema).read_text(encoding="utf-8"))
    if error := best_match(Draft202012Validator(rules).iter_errors(value)):
        key = ".".join(str(p) for p in error.absolute_path) or "manifest"
        raise InputError(f"{name}: {key}: {error.message}; make the bundle again")
    for fault in _find_faults(Manifest.from_dict(value)):
        raise InputError(f"{name}: {fault}; make the bundle again")


def _find_faults(manifest: Manifest) -> Iterator[str]:
    """What the schema cannot express."""
    levels, tiles = manifest.levels, manifest.tiles
    if [level.level for level in levels] != list(range(len(levels))):
        yield "levels must count up from 0"
    distances = [level.distance for level in levels]
    known = [distance for distance in distances[:-1] if distance is not None]
    if len(known) < len(levels) - 1 or distances[-1] is not None or known != sorted(set(known)):
        yield "levels: distances must rise, and only the last is null"
    if any(b.mean_scale <= a.mean_scale for a, b in zip(levels, levels[1:], strict=False)):
        yield "levels: mean_scale must strictly rise"
    if [tile.tile for tile in tiles] != list(range(len(tiles))) or len(tiles) % 16:
        yield f"{len(tiles)} tiles: they must be 0 to 16 C - 1, in order"
    for tile in tiles:
        if [chunk.level for chunk in tile.chunks] != list(range(len(levels))):
            yield f"tile {tile.tile}: one chunk a level is needed, in order"
        for chunk in tile.chunks:
            if chunk.bytes != chunk_size(chunk.count, len(chunk.orders)):
                yield f"{chunk.file}: bytes do not fit count and orders"
            if max(chunk.orders) >= len(manifest.directions):
                yield f"{chunk.file}: an order of a direction that is not there"


def read_manifest(folder: Path | str, schema: Path | str) -> Manifest:
    """Read and check a bundle's manifest.

    Raises: InputError: missing, too large, no JSON, of another format or version, or see `check_manifest`.
    """
    path = Path(folder) / NAME
    if path.is_file() and path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: {path.stat().st_size} bytes are no manifest; make the bundle again")
    value = read_json(path)
    known = isinstance(value, dict) and (value.get("format"), value.get("version"))
    if known != (FORMAT, VERSION):
        raise InputError(f"{path}: not a bundle of format {FORMAT!r}, version {VERSION}; make the bundle again")
    check_manifest(value, schema, path)
    return Manifest.from_dict(value)
