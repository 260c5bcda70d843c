"""A tile set whose cuts are refined: pictures around them repaired together, and the Gaussians beside them refitted."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.logs import progress
from dav_gswt.prior import conditions
from dav_gswt.prior.interface import Condition
from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.study.refine import limits, refit, viewpoints
from dav_gswt.study.refine.refit import Wanted
from dav_gswt.study.refine.repair import Repair
from dav_gswt.study.refine.viewpoints import Place
from dav_gswt.tiles import compose, poisson_blending
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import CENTRE, Exemplar

_log = logging.getLogger(__name__)

SOLID = 0.5  # opacity by which a colour over black is divided, at least


@dataclass(frozen=True)
class Options:
    """views: of each place of a cut. width: of a picture, in cells of the ground. reach: from a cut, in cells, to where
    nothing is changed. rounds: how often pictures are repaired and Gaussians refitted to them, fit: in so many steps.
    colour, opacity, position: the most that a Gaussian may be changed by beside a cut, in all: a colour in [0, 1], a
    logit, and a share of a cell.
    """

    views: int = 4
    width: int = 64
    reach: float = 8.0
    rounds: int = 1
    fit: int = 12
    colour: float = 0.08
    opacity: float = 0.5
    position: float = 0.25

    @classmethod
    def of(cls, entry: dict) -> "Options":
        """Of what an entry of the config's `seams` says under `refine`."""
        return cls(**{key: entry[key] for key in vars(cls()) if key in entry})


@dataclass(frozen=True)
class Uncut:
    """The exemplar's finest level: what ground looks like where nothing was cut."""

    field: GaussianField
    exemplar: Exemplar


def refined(tiles: TileSet, uncut: Uncut, options: Options, repair: Repair, size: int) -> TileSet:
    """The tile set with the cuts between centres and frames repaired, in pictures of `size` pixels.

    The finest level is refitted; coarser ones take the mean change of colour of each cell. What reaches a border keeps
    its bits in every level. Tiles are refined one by one among neighbours that stay as they were cut, so their order
    does not matter. Where the repair adds nothing, nothing changes.
    """
    finest, told = [], []
    for number in progress(range(len(tiles.labels)), "refine tiles"):
        made, facts = _tile(tiles, number, uncut, options, repair, size)
        finest.append(made)
        told.append(facts)
    levels = [finest]
    for level in range(1, len(tiles.fields)):
        levels.append([_follows(tiles, level, number, finest[number]) for number in range(len(finest))])
    _log.info("%d of %d Gaussians changed", sum(f["changed"] for f in told), sum(map(len, finest)))
    more = tiles.report.more | {"refined": {"options": vars(options), "tiles": told}}
    return replace(tiles, fields=levels, report=replace(tiles.report, more=more))


def _tile(
    tiles: TileSet, number: int, uncut: Uncut, options: Options, repair: Repair, size: int
) -> tuple[GaussianField, dict]:
    """One tile's finest level, and what was done to it."""
    cell, labels, field = tiles.spacing, tiles.labels[number], tiles.fields[0][number]
    share = limits.shares(labels, options.reach, float(tiles.report.layout.strip))
    bounds = limits.bounds(field, share, tiles.side, options.colour, options.opacity, options.position * cell)
    around = viewpoints.assembly(tiles.fields[0], number, tiles.side)
    points, width = viewpoints.points(labels, options.width // 2), options.width * cell
    places = [viewpoints.place(field, around, (at + 0.5) * cell, width, options.views, size) for at in points]
    photos = [
        photo
        for at, place in zip(points, places, strict=True)
        for photo in _photos(uncut, (at + 0.5) * cell, tiles.shifts[number, CENTRE], place, width)
    ]
    moves, before, after = np.zeros((len(field), 7), np.float32), 0.0, 0.0
    for _ in range(options.rounds if places else 0):
        now = refit.changed(field, moves, bounds.scale)
        wanted = _wanted(now, bounds, places, np.stack(photos), viewpoints.flying_height(width), repair)
        moves, before, after = refit.refitted(field, wanted, bounds, moves, options.fit)
    changed = int(moves.any(1).sum())
    facts = {"views": len(photos), "changed": changed, "apart": [before, after], "moves": _rms(moves[bounds.free])}
    return refit.changed(field, moves, bounds.scale), facts


def _rms(moves: Float32[Array, "n 7"]) -> float:
    return float(np.sqrt((moves.astype(float) ** 2).mean())) if len(moves) else 0.0


def _photos(
    uncut: Uncut, at: Float[Array, "2"], shift: Int[Array, "2"], place: Place, width: float
) -> list[Float32[Array, "s s 3"]]:
    """The uncut ground that a tile's centre comes from, seen as the cut is: it goes on where the tile does not."""
    exemplar = uncut.exemplar
    by = np.array([exemplar.west, exemplar.south]) + shift * exemplar.spacing
    there = uncut.field[viewpoints.near(uncut.field, at + by, viewpoints.SPREAD * width)]
    rise = viewpoints.ground_height(there, at + by, 0.1 * width) - place.middle[2]
    seen = [
        conditions.render_view(
            there, viewpoints.shifted(camera, np.array([*by, rise])), viewpoints.flying_height(width)
        )
        for camera in place.cameras
    ]
    return [np.clip(s.colour / np.maximum(s.alpha, SOLID)[..., None], 0, 1).astype(np.float32) for s in seen]


def _wanted(
    field: GaussianField,
    bounds: limits.Bounds,
    places: list[Place],
    photos: Float32[Array, "b s s 3"],
    flying_height: float,
    repair: Repair,
) -> list[Wanted]:
    """What all places are to show to all their cameras: what they show, and what the repair adds to it."""
    drawn, shown, near, now = Rasterizer(), [], [], []
    looks = [(place, camera) for place in places for camera in place.cameras]
    for place, camera in looks:
        both = concatenate_fields([field[place.own], place.around])
        share = np.zeros((len(both), 1), np.float32)
        share[: len(place.own), 0] = bounds.share[place.own]
        shown.append(conditions.render_view(both, camera, flying_height))
        now.append(drawn.forward(**to_raster_arrays(both), camera=camera).colour)
        near.append(np.clip(drawn.forward(**to_raster_arrays(both, share), camera=camera).colour[..., 0], 0, 1))
    parts = (np.stack([getattr(s, name) for s in shown]) for name in ("colour", "alpha", "inverse_depth"))
    same = np.tile(np.float32([0, 0, 1, 0]), (len(looks), 1))
    added = repair(Condition(*parts, photos, same), np.stack(near))
    return [
        Wanted(*look, picture + more, weight)
        for look, picture, more, weight in zip(looks, now, added, near, strict=True)
    ]


def _follows(tiles: TileSet, level: int, number: int, finest: GaussianField) -> GaussianField:
    """A coarser level of a tile, with the mean change of colour of what it stands for."""
    before, field, labels = tiles.fields[0][number], tiles.fields[level][number], tiles.labels[number]
    change, count = np.zeros((*labels.shape, 4)), np.zeros((*labels.shape, 1))
    column, row = (np.clip((before.means[:, i] / tiles.spacing).astype(int), 0, len(labels) - 1) for i in (0, 1))
    np.add.at(change, (row, column), np.pad(finest.sh[:, 0] - before.sh[:, 0], [(0, 0), (0, 1)]))
    np.add.at(count, (row, column), 1)
    change /= np.maximum(count, 1)
    coarse = poisson_blending.coarsen_correction(change, labels, compose.coarsen_labels(labels, 2**level))
    by = limits.in_cells(field, coarse[..., :3], tiles.side)
    rows = np.flatnonzero(by.any(1) & (limits.clearance(field, tiles.side) > 0))
    sh = field.sh.copy()
    sh[rows, 0] += by[rows].astype(np.float32)
    return replace(field, sh=sh)
