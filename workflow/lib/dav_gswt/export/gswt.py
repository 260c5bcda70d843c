"""The tile set for other programs: gswt.zip as the public GSWT web renderer reads it, and a PLY a tile and level.

In gswt.zip tiles are 4.0 wide, with 62 floats a splat. The renderer's loader never reads property names and crashes on
one header line too many, so nothing here is optional. It knows tiles only, so objects are baked into them.
"""

import logging
import zipfile
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.store import Bundle
from dav_gswt.field import GaussianField, concatenate_fields, write_field
from dav_gswt.files import atomic_file, atomic_folder, write_json
from dav_gswt.logs import progress
from dav_gswt.materials.model import ObjectLevels, turn_and_scale, turn_rows
from dav_gswt.tiles.compose import bump
from dav_gswt.tiles.store import write_tile_fields

_log = logging.getLogger(__name__)

NAME, MARK = "gswt.zip", "tiles.json"
TILE_WIDTH = 4.0
MAX_SPLATS = 8_388_608
STAMP = (1980, 1, 1, 0, 0, 0)  # the earliest a zip knows: the same tiles give the same bytes
TURN, SIZE = np.radians(15.0), 0.15  # largest turn and change of size of a baked object
TRIES = 60  # places that are tried for each object
EDGE = 0.04  # of a tile's side: a border that no object touches, so that tiles fit as they did without objects


def to_renderer(field: GaussianField, side: float) -> GaussianField:
    """A tile `side` wide, scaled to TILE_WIDTH; quaternions have length 1, and colour does not depend on the view.

    Harmonics of degree 3, all zero, give the PLY the 62 properties that the renderer expects.
    """
    means = field.means.astype(float) * (TILE_WIDTH / side)
    means[:, :2] = np.clip(means[:, :2], 0, TILE_WIDTH)
    quats = field.quats.astype(float)  # a length that float32 cannot square must not overflow on the way
    return GaussianField(
        means.astype(np.float32),
        (field.log_scales + np.log(TILE_WIDTH / side)).astype(np.float32),
        (quats / np.linalg.norm(quats, axis=1, keepdims=True)).astype(np.float32),
        field.opacity_logits,
        np.pad(field.sh[:, :1], ((0, 0), (0, 15), (0, 0))),
        np.zeros(len(field), np.float32),
        np.zeros(len(field), bool),
    )


def write_gswt(fields: list[list[GaussianField]], side: float, path: Path) -> None:
    """Write fields[level][tile] as lod{L}_tile_{T}.ply entries, in a fixed order with a fixed time.

    The finest levels are left out, with a warning, as far as the renderer could not take them all.
    """
    levels = list(fields)
    while len(levels) > 1 and sum(len(field) for level in levels for field in level) > MAX_SPLATS:
        levels.pop(0)
    if (left_out := len(fields) - len(levels)) > 0:
        said = "gswt.zip lacks the finest %d of %d levels: its renderer takes %d splats"
        _log.warning(said, left_out, len(fields), MAX_SPLATS)
    flat = [(level, tile, field) for level, tiles in enumerate(levels) for tile, field in enumerate(tiles)]
    with zipfile.ZipFile(path, "w") as archive, TemporaryDirectory(dir=path.parent) as folder:
        for level, tile, field in progress(flat, "write gswt.zip"):
            ply = Path(folder, f"lod{level}_tile_{tile:02d}.ply")
            write_field(to_renderer(field, side), ply, plain=True)
            entry = zipfile.ZipInfo(ply.name, STAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, ply.read_bytes(), compresslevel=1)


def export_archive(bundle: Bundle, path: Path | str) -> None:
    """Write gswt.zip of a bundle: the tiles of the first material with its objects baked into them.

    Raises: InputError: see `Bundle.chunk`.
    """
    manifest = bundle.manifest
    each, levels = len(manifest.tiles) // len(manifest.materials), range(len(manifest.levels))
    fields = [[bundle.chunk(tile, level) for tile in range(each)] for level in levels]
    mine = [(k, entry) for k, entry in enumerate(manifest.objects or []) if entry.material == 0]
    objects = [
        ObjectLevels(entry.name, [bundle.object_chunk(k, level) for level in levels], entry.radius, 0, entry.density)
        for k, entry in mine
    ]
    ground = mine[0][1].ground if mine else 0.0
    with atomic_file(path) as part:
        write_gswt(bake_objects(fields, objects, ground, manifest.tile_side, manifest.salt), manifest.tile_side, part)


def export_tiles(bundle: Bundle, folder: Path | str) -> None:
    """Write lod{l}_tile_{TT}.ply of all tiles, and MARK, to a folder. Raises: InputError: see `Bundle.chunk`."""
    with atomic_folder(folder) as part:
        write_tile_fields(bundle.fields(), part)
        write_json(part / MARK, {"tile_side": bundle.manifest.tile_side, "tiles": len(bundle.manifest.tiles)})


def bake_objects(
    tiles: list[list[GaussianField]], objects: list[ObjectLevels], ground: float, side: float, salt: int
) -> list[list[GaussianField]]:
    """tiles[level][tile] with objects: another draw for each tile, none over an edge.

    A tile has as many of an object as its area and the density give, rounded by chance. Footprints do not overlap; what
    finds no room is left out. The public renderer shifts each tile by its own mean height, so these are made equal
    again. ground: height of the objects' feet.
    """
    fields = [list(level) for level in tiles]
    for tile in range(len(tiles[0])):
        rng = np.random.default_rng([salt, 0, tile])
        counts = [int(each.density * side**2 + rng.random()) for each in objects]
        drawn = _draw_objects(objects, counts, side, ground, rng)
        for level, own in enumerate(fields):
            own[tile] = concatenate_fields([own[tile], *(each[level] for each in drawn)])
    tiles_first = [list(levels) for levels in zip(*fields, strict=True)]
    return [list(level) for level in zip(*equalise_heights(tiles_first, side), strict=True)]


def equalise_heights(tiles: list[list[GaussianField]], side: float) -> list[list[GaussianField]]:
    """Give all tiles the same mean height at the finest level; tiles[t][l] is level l of tile t.

    A rigid shift would tear borders apart, so a tile is raised by A_t bump(x, y) in all its levels alike; A_t makes
    the mean over its finest Gaussians that of all tiles.
    """
    heights = [float(levels[0].means[:, 2].astype(float).mean()) for levels in tiles]
    goal = float(np.mean(heights))
    raised = []
    for levels, mean in zip(tiles, heights, strict=True):
        share = bump(levels[0].means, side).mean()
        amount = (goal - mean) / share if share > 0 else 0.0
        raised.append([_raise_tile(field, amount, side) for field in levels])
    return raised


def _raise_tile(field: GaussianField, amount: float, side: float) -> GaussianField:
    means = field.means.copy()
    means[:, 2] += (amount * bump(field.means, side)).astype(np.float32)
    return replace(field, means=means)


def _draw_objects(
    objects: list[ObjectLevels], counts: list[int], side: float, ground: float, rng: np.random.Generator
) -> list[list[GaussianField]]:
    """The Gaussians of the objects in a tile, of each by level.

    The largest objects come first, each at the first of TRIES places where it overlaps no other.
    """
    drawn, taken = [], []
    for each, count in sorted(zip(objects, counts, strict=True), key=lambda pair: -pair[0].radius):
        reach = max(float(np.abs(f.means[:, :2]).max(initial=0.0)) for f in each.fields)
        for _ in range(count):
            turn, size = rng.uniform(-TURN, TURN), 1 + rng.uniform(-SIZE, SIZE)
            margin, radius = 2**0.5 * reach * size + EDGE * side, each.radius * size
            places = rng.uniform(margin, side - margin, (TRIES, 2)) if 2 * margin < side else np.zeros((0, 2))
            free = [p for p in places if all(np.hypot(*(p - foot)) >= radius + other for foot, other in taken)]
            if free:
                taken.append((free[0], radius))
                foot = np.array([*free[0], ground])
                drawn.append([_place(field, turn, size, foot) for field in each.fields])
    return drawn


def _place(field: GaussianField, turn: float, size: float, foot: Float[Array, "3"]) -> GaussianField:
    n = len(field)
    return turn_and_scale(field, turn_rows(np.full(n, turn)), np.full(n, size), np.tile(foot, (n, 1)))
