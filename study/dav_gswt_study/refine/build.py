"""Refine the seams of a tile set: repair pictures of them by a prior and refit the Gaussians beside them."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.logs import progress
from dav_gswt.prior import conditions
from dav_gswt.prior.interface import Condition
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.tiles import compose, poisson_blending
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import CENTRE, Exemplar
from dav_gswt_study.refine import limits, refit, viewpoints
from dav_gswt_study.refine.refit import RefitTarget
from dav_gswt_study.refine.repair import Repair
from dav_gswt_study.refine.viewpoints import SeamView

_log = logging.getLogger(__name__)

LEAST_ALPHA = 0.5  # by which a colour over black is divided, at least


@dataclass(frozen=True)
class Options:
    """views: per place of a seam. width: of a picture, in cells. reach: cells from a seam to where nothing changes.
    rounds: of repair and refit. fit: steps of a refit. colour, opacity, position: greatest change of a Gaussian at a
    seam: of a colour in [0, 1], of the logit, and in cells.
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
    def from_config(cls, entry: dict) -> "Options":
        """The options under `refine` of an entry of the config."""
        return cls(**{key: entry[key] for key in vars(cls()) if key in entry})


@dataclass(frozen=True)
class UncutGround:
    """The finest level of the exemplar: ground without seams."""

    field: GaussianField
    exemplar: Exemplar


def refine_tiles(tiles: TileSet, uncut: UncutGround, options: Options, repair: Repair, size: int) -> TileSet:
    """The tile set with the seams between centres and frames refined, in pictures of `size` pixels.

    The finest level is refitted; coarser levels take the mean change of colour of each cell. Gaussians that reach a
    border keep their bits. Each tile is refined among unrefined neighbours, so the order of tiles does not matter.
    """
    finest, facts = [], []
    for number in progress(range(len(tiles.labels)), "refine tiles"):
        tile, tile_facts = _refine_tile(tiles, number, uncut, options, repair, size)
        finest.append(tile)
        facts.append(tile_facts)
    levels = [finest]
    for level in range(1, len(tiles.fields)):
        levels.append([_update_level(tiles, level, number, finest[number]) for number in range(len(finest))])
    _log.info("%d of %d Gaussians changed", sum(f["changed"] for f in facts), sum(map(len, finest)))
    report = tiles.report | {"refined": {"options": vars(options), "tiles": facts}}
    return replace(tiles, fields=levels, report=report)


def _refine_tile(
    tiles: TileSet, number: int, uncut: UncutGround, options: Options, repair: Repair, size: int
) -> tuple[GaussianField, dict]:
    """The finest level of a tile, and facts about its refinement."""
    cell, labels, field = tiles.spacing, tiles.labels[number], tiles.fields[0][number]
    share = limits.compute_shares(labels, options.reach, float(tiles.layout.strip))
    bounds = limits.compute_bounds(field, share, tiles.side, options.colour, options.opacity, options.position * cell)
    around = viewpoints.assemble_neighbours(tiles.fields[0], number, tiles.side)
    points, width = viewpoints.find_seam_points(labels, options.width // 2), options.width * cell
    places = [viewpoints.view_seam(field, around, (at + 0.5) * cell, width, options.views, size) for at in points]
    photos = [
        photo
        for at, place in zip(points, places, strict=True)
        for photo in _render_uncut(uncut, (at + 0.5) * cell, tiles.shifts[number, CENTRE], place, width)
    ]
    moves, before, after = np.zeros((len(field), 7), np.float32), 0.0, 0.0
    for _ in range(options.rounds if places else 0):
        now = refit.apply_moves(field, moves, bounds.scale)
        targets = _make_targets(now, bounds, places, np.stack(photos), viewpoints.flying_height(width), repair)
        moves, before, after = refit.refit_gaussians(field, targets, bounds, moves, options.fit)
    changed = int(moves.any(1).sum())
    facts = {"views": len(photos), "changed": changed, "apart": [before, after], "moves": _rms(moves[bounds.free])}
    return refit.apply_moves(field, moves, bounds.scale), facts


def _rms(moves: Float32[Array, "n 7"]) -> float:
    return float(np.sqrt((moves.astype(float) ** 2).mean())) if len(moves) else 0.0


def _render_uncut(
    uncut: UncutGround, at: Float[Array, "2"], shift: Int[Array, "2"], place: SeamView, width: float
) -> list[Float32[Array, "s s 3"]]:
    """The uncut ground from which the centre of a tile comes, seen by the cameras of a seam."""
    exemplar = uncut.exemplar
    by = np.array([exemplar.west, exemplar.south]) + shift * exemplar.spacing
    there = uncut.field[viewpoints.mask_near(uncut.field, at + by, viewpoints.SPREAD * width)]
    rise = viewpoints.ground_height(there, at + by, 0.1 * width) - place.middle[2]
    seen = [
        conditions.render_view(
            there, viewpoints.shift_camera(camera, np.array([*by, rise])), viewpoints.flying_height(width)
        )
        for camera in place.cameras
    ]
    return [np.clip(s.colour / np.maximum(s.alpha, LEAST_ALPHA)[..., None], 0, 1).astype(np.float32) for s in seen]


def _make_targets(
    field: GaussianField,
    bounds: limits.Bounds,
    places: list[SeamView],
    photos: Float32[Array, "b s s 3"],
    flying_height: float,
    repair: Repair,
) -> list[RefitTarget]:
    """The pictures of all places: their render plus what the repair adds."""
    rasterizer, renders, near, now = make_rasterizer(), [], [], []
    looks = [(place, camera) for place in places for camera in place.cameras]
    for place, camera in looks:
        both = concatenate_fields([field[place.own], place.around])
        share = np.zeros((len(both), 1), np.float32)
        share[: len(place.own), 0] = bounds.share[place.own]
        renders.append(conditions.render_view(both, camera, flying_height))
        now.append(rasterizer.forward(**to_raster_arrays(both), camera=camera).colour)
        near.append(np.clip(rasterizer.forward(**to_raster_arrays(both, share), camera=camera).colour[..., 0], 0, 1))
    condition = Condition(
        np.stack([r.colour for r in renders]),
        np.stack([r.alpha for r in renders]),
        np.stack([r.inverse_depth for r in renders]),
        photos,
        np.tile(np.array([0, 0, 1, 0], np.float32), (len(looks), 1)),
    )
    added = repair(condition, np.stack(near))
    return [
        RefitTarget(*look, picture + more, weight)
        for look, picture, more, weight in zip(looks, now, added, near, strict=True)
    ]


def _update_level(tiles: TileSet, level: int, number: int, finest: GaussianField) -> GaussianField:
    """A coarser level of a tile with the mean change of colour of its cells."""
    before, field, labels = tiles.fields[0][number], tiles.fields[level][number], tiles.labels[number]
    change, count = np.zeros((*labels.shape, 4)), np.zeros((*labels.shape, 1))
    column, row = (np.clip((before.means[:, i] / tiles.spacing).astype(int), 0, len(labels) - 1) for i in (0, 1))
    np.add.at(change, (row, column), np.pad(finest.sh[:, 0] - before.sh[:, 0], [(0, 0), (0, 1)]))
    np.add.at(count, (row, column), 1)
    change /= np.maximum(count, 1)
    coarse = poisson_blending.coarsen_correction(change, labels, compose.coarsen_labels(labels, 2**level))
    by = limits.lookup_cells(field, coarse[..., :3], tiles.side)
    rows = np.flatnonzero(by.any(1) & (limits.border_clearance(field, tiles.side) > 0))
    sh = field.sh.copy()
    sh[rows, 0] += by[rows].astype(np.float32)
    return replace(field, sh=sh)
