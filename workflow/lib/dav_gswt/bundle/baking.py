"""Objects baked into tiles, for the public renderer, which knows tiles only."""

import logging
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.content import BundleContent
from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.materials.model import ObjectLevels
from dav_gswt.materials.model import turn_and_scale, turn_rows
from dav_gswt.tiles.compose import equalise_heights

_log = logging.getLogger(__name__)

TURN, SIZE = np.radians(15.0), 0.15  # largest turn and change of size of an object
TRIES = 60  # places that are tried for each object
EDGE = 0.04  # of a tile's side: a border that no object touches, so that tiles fit as they did without objects


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
