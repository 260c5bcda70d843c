"""gswt.zip: the tile set as the public GSWT web renderer reads it (tiles 4.0 wide, 62 floats a splat).

The renderer's loader never reads property names and crashes on one header line too many, so nothing here
is optional. It knows tiles only, so objects are baked into them.
"""

import logging
import re
import zipfile
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.content import BundleContent
from dav_gswt.errors import InputError, summarize_error
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.files import UNREADABLE
from dav_gswt.logs import progress
from dav_gswt.materials.model import ObjectLevels, turn_and_scale, turn_rows
from dav_gswt.tiles.compose import equalise_heights

_log = logging.getLogger(__name__)

TILE_WIDTH = 4.0
MAX_SPLATS = 8_388_608
TILE_NAME = re.compile(r"lod(\d{1,3})_tile_(\d{1,4}).*\.ply")  # as the renderer looks for them
STAMP = (1980, 1, 1, 0, 0, 0)  # the earliest a zip knows: the same tiles give the same bytes
TURN, SIZE = np.radians(15.0), 0.15  # largest turn and change of size of a baked object
TRIES = 60  # places that are tried for each object
EDGE = 0.04  # of a tile's side: a border that no object touches, so that tiles fit as they did without objects
PROPERTIES = [
    *("x", "y", "z", "nx", "ny", "nz"),
    *(f"f_dc_{i}" for i in range(3)),
    *(f"f_rest_{i}" for i in range(45)),
    "opacity",
    *(f"scale_{i}" for i in range(3)),
    *(f"rot_{i}" for i in range(4)),
]


def to_rows(field: GaussianField, side: float) -> Float32[Array, "n 62"]:
    """Splats of a tile `side` wide, scaled to TILE_WIDTH, without view-dependent colour; quaternions have length 1."""
    scale = TILE_WIDTH / side
    out = np.zeros((len(field), len(PROPERTIES)), np.float32)
    out[:, :3] = field.means.astype(float) * scale
    out[:, :2] = np.clip(out[:, :2], 0, TILE_WIDTH)
    out[:, 6:9] = field.sh[:, 0]
    out[:, 54] = field.opacity_logits
    out[:, 55:58] = field.log_scales + np.log(scale)
    quats = field.quats.astype(float)  # a length that float32 cannot square must not overflow on the way
    out[:, 58:] = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    return out


def format_ply(values: Float32[Array, "n 62"]) -> bytes:
    """The renderer's PLY: 65 header lines before end_header, no comment."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(values)}"]
    lines += [f"property float {name}" for name in PROPERTIES]
    return "\n".join([*lines, "end_header\n"]).encode("ascii") + values.astype("<f4").tobytes()


def fit_to_renderer(fields: list[list[GaussianField]]) -> list[list[GaussianField]]:
    """Fields by level and tile without the finest levels, as far as the renderer could not take them all."""
    levels = list(fields)
    while len(levels) > 1 and sum(len(field) for level in levels for field in level) > MAX_SPLATS:
        levels.pop(0)
    if len(levels) < len(fields):
        said = "gswt.zip lacks the finest %d of %d levels: its renderer takes %d splats"
        _log.warning(said, len(fields) - len(levels), len(fields), MAX_SPLATS)
    return levels


def write_gswt(fields: list[list[GaussianField]], side: float, path: Path) -> None:
    """Write fields[level][tile] as lod{L}_tile_{T}.ply entries, in a fixed order with a fixed time.

    Raises: InputError: a tile has no splat, there are more than the renderer takes, or a value is not finite.
    """
    total = sum(len(field) for level in fields for field in level)
    if total > MAX_SPLATS:
        raise InputError(
            f"{path.name}: {total} splats, the renderer takes {MAX_SPLATS}; use smaller tiles or fewer variants"
        )
    flat = [(level, tile, field) for level, tiles in enumerate(fields) for tile, field in enumerate(tiles)]
    with zipfile.ZipFile(path, "w") as archive:
        for level, tile, field in progress(flat, "write gswt.zip"):
            if not len(field):
                raise InputError(f"level {level}, tile {tile}: no splat in it; the field has a hole as wide as a tile")
            values = to_rows(field, side)
            if not np.isfinite(values).all():
                raise InputError(f"level {level}, tile {tile}: a value is not finite")
            entry = zipfile.ZipInfo(f"lod{level}_tile_{tile:02d}.ply", STAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, format_ply(values), compresslevel=1)


def read_gswt(path: Path | str, side: float) -> list[list[GaussianField]]:
    """fields[level][tile] of an archive, made by `write_gswt` or another program, for tiles `side` wide.

    An entry's recorded size is compared with its header before it is unpacked, and all of it with the most that
    the renderer takes. Only base names count, so nothing is written anywhere; other entries are skipped.
    Raises: InputError: no zip, a damaged entry, a header that is not the renderer's, sizes that do not agree, levels or
    tiles that do not count up from 0, a value that is not finite, a zero quaternion.
    """
    found = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for entry in archive.infolist():
                if match := TILE_NAME.search(Path(entry.filename).name):
                    key = int(match[1]), int(match[2])
                    if key in found:
                        raise InputError(f"{path}: {entry.filename[:80]!r} is there twice; make the bundle again")
                    found[key] = _read_entry(archive, entry, side, MAX_SPLATS - sum(map(len, found.values())))
    except UNREADABLE as error:
        raise InputError(f"{path}: not readable ({summarize_error(error)}); make the bundle again") from error
    levels, tiles = ({key[axis] for key in found} for axis in (0, 1))
    if not found or len(tiles) % 16 or set(found) != set(product(range(len(levels)), range(len(tiles)))):
        raise InputError(f"{path}: not a whole set of 16 tiles at each level; make the bundle again")
    return [[found[level, tile] for tile in range(len(tiles))] for level in range(len(levels))]


def _read_entry(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, side: float, room: int) -> GaussianField:
    """An entry's Gaussians; room: how many are left of MAX_SPLATS."""
    name = f"{archive.filename}: {' '.join(entry.filename.split())[:80]}"
    none = format_ply(np.zeros((0, len(PROPERTIES)), np.float32))
    with archive.open(entry) as file:
        head = file.read(len(none) + 8)
        count = re.match(rb"ply\nformat binary_little_endian 1\.0\nelement vertex (\d{1,8})\n", head)
        header = none.replace(b"vertex 0", b"vertex " + count[1]) if count else none
        if not count or not head.startswith(header):
            raise InputError(f"{name}: not a tile of the GSWT renderer; make the bundle again")
        n, width = int(count[1]), 4 * len(PROPERTIES)
        if not 0 < n <= room or entry.file_size != len(header) + n * width:
            raise InputError(f"{name}: {n} splats in {entry.file_size} bytes; make the bundle again")
        data = (head[len(header) :] + file.read(n * width))[: n * width]
    if len(data) != n * width:
        raise InputError(f"{name}: cut short; make the bundle again")
    values = np.frombuffer(data, "<f4").reshape(n, len(PROPERTIES)).astype(np.float32)
    if not np.isfinite(values).all():
        raise InputError(f"{name}: a value is not finite; make the bundle again")
    if len(zero := np.flatnonzero(~values[:, 58:].any(1))):
        raise InputError(f"{name}: splat {zero[0]} has a zero quaternion; remove it and try again")
    scale = TILE_WIDTH / side
    return GaussianField(
        (values[:, :3] / scale).astype(np.float32),
        (values[:, 55:58] - np.log(scale)).astype(np.float32),
        values[:, 58:].copy(),  # a view would keep all 62 columns in memory
        values[:, 54].copy(),
        values[:, None, 6:9].copy(),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


@dataclass(frozen=True)
class _BakedObject:
    """An object in a tile: its place, turn, size, and the radius of its footprint at that size."""

    source: ObjectLevels
    foot: Float[Array, "3"]
    turn: float
    size: float
    radius: float


def bake_objects(content: BundleContent, material: int, salt: int) -> list[list[GaussianField]]:
    """fields[level][tile] of a material with its objects in them: another draw for each tile, none over an edge.

    A tile has as many of an object as its area and the density give, rounded by chance. Footprints do not overlap; what
    finds no room is left out. The public renderer shifts each tile by its own mean height, so these are made equal
    again.
    """
    tiles = content.tiles[material]
    mine = [each for each in content.objects if each.material == material]
    if not mine:
        return tiles.fields
    fields, ground = [list(level) for level in tiles.fields], content.ground_height(material)
    wanted = placed = 0
    for tile in range(len(tiles.labels)):
        rng = np.random.default_rng([salt, material, tile])
        counts = [int(each.density * content.side**2 + rng.random()) for each in mine]
        drawn = _draw_objects(mine, counts, content.side, ground, rng)
        wanted, placed = wanted + sum(counts), placed + len(drawn)
        for level in range(content.levels):
            fields[level][tile] = concatenate_fields([fields[level][tile], *(_place(each, level) for each in drawn)])
    if placed < wanted:
        _log.info("gswt: %d of %d objects find room in the middle of tiles", placed, wanted)
    tiles_first = [list(levels) for levels in zip(*fields, strict=True)]
    raised, _ = equalise_heights(tiles_first, content.side)
    return [list(level) for level in zip(*raised, strict=True)]


def _draw_objects(
    objects: list[ObjectLevels], counts: list[int], side: float, ground: float, rng: np.random.Generator
) -> list[_BakedObject]:
    """The largest objects first, each at the first of TRIES places where it overlaps no other."""
    drawn: list[_BakedObject] = []
    for each, count in sorted(zip(objects, counts, strict=True), key=lambda pair: -pair[0].radius):
        reach = max(float(np.abs(f.means[:, :2]).max(initial=0.0)) for f in each.fields)
        for _ in range(count):
            turn, size = rng.uniform(-TURN, TURN), 1 + rng.uniform(-SIZE, SIZE)
            margin, radius = 2**0.5 * reach * size + EDGE * side, each.radius * size
            places = rng.uniform(margin, side - margin, (TRIES, 2)) if 2 * margin < side else np.zeros((0, 2))
            free = [p for p in places if all(np.hypot(*(p - o.foot[:2])) >= radius + o.radius for o in drawn)]
            if free:
                drawn.append(_BakedObject(each, np.array([*free[0], ground]), turn, size, radius))
    return drawn


def _place(each: _BakedObject, level: int) -> GaussianField:
    source = each.source.fields[level]
    n = len(source)
    return turn_and_scale(source, turn_rows(np.full(n, each.turn)), np.full(n, each.size), np.tile(each.foot, (n, 1)))
