"""A field whose unseen ground is painted by a prior. What photos saw keeps its bytes; what is painted is marked."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.inpainting import occluders, unseen, viewpoints
from dav_gswt.inpainting.paint import LEAST_ALPHA, painted
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.prior import conditions
from dav_gswt.prior.conditions import ReferencePhotos
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views.prior_sampling import PriorConfig

_log = logging.getLogger(__name__)

INSET = 2.0  # pixels along a picture's border that are not used: the prior knows little of what lies beyond


@dataclass(frozen=True)
class Completed:
    """A field, the cells that no photo saw, and those of them that were painted. things: Gaussians that are new."""

    field: GaussianField
    unseen: Bool[Array, "rows columns"]
    painted: Bool[Array, "rows columns"]
    things: int

    def facts(self, grid: Ground) -> dict:
        """What completion.json says."""
        block = np.s_[grid.first_row : grid.first_row + grid.cells, grid.first_column : grid.first_column + grid.cells]
        counts = {"cells": grid.heights.size, "unseen": int(self.unseen.sum()), "painted": int(self.painted.sum())}
        inside = {"unseen": int(self.unseen[block].sum()), "painted": int(self.painted[block].sum())}
        return counts | {"things": self.things, "exemplar": inside, "changed": bool(self.field.imagined.any())}


def complete(
    field: GaussianField, grid: Ground, frame: SceneFrame, taken: list[TrainingView], asked: PriorConfig
) -> Completed:
    """Paint the ground that no photo saw, one picture from above after the other, each told of those before.

    Discs of such ground, and the underlay under them alone, take the painted colours and keep their places: a prior's
    depth is rougher than the ground's surface. Gaussians are added where it says from two sides that something stands
    (`standing`). All these are marked: `imagined`, uncertainty 1. No fit: a picture of 64 pixels is coarser than the
    discs, so colours are read off. The grid is not changed: `seen` stays what photos saw.

    A cell that nothing sees from above, since a known thing covers it, keeps its colour, unmarked.
    Returns: the field itself, where there is nothing to paint or the field has no ground layer.
    Raises: ValueError: see `painting.painted`.
    """
    there = unseen.cells(field, grid)
    _log.info("%d of %d cells of the ground were seen by no photo", there.sum(), there.size)
    if not there.any():
        return Completed(field, there, there, 0)
    targets = viewpoints.blocks(grid, there, frame.flying_height)
    known = conditions.prepare_photos(taken, frame, asked.model.size)
    told, todo, ground = field, there, _ground_colour(field, grid)
    for target in progress(targets, "paint unseen ground"):
        for pose, camera in viewpoints.cameras(viewpoints.ABOVE, target, told, grid, frame, asked.model.size):
            condition = conditions.build_condition(told, [(pose, camera)], known, frame.flying_height, asked.model.size)
            sees, seeks = (unseen.share(told, unseen.gaussians(field, grid, cells), camera) for cells in (there, todo))
            made = painted(asked, condition, seeks[None] > unseen.TOUCHES, ground)
            good = (sees > unseen.LOOKS) & (made.alpha[0] > LEAST_ALPHA)
            told, todo = _coloured(told, todo, camera, made.colour[0], good)
    done = there & ~todo
    if not done.any():
        _log.info("none of them is in sight: known things cover them all")
        return Completed(field, there, done, 0)
    marked = unseen.gaussians(field, grid, done)
    out = _marked(_above_underlay(told, grid, marked), marked)
    made = concatenate_fields([out, *_standing(out, grid, frame, known, targets, asked)])
    _log.info("%d cells painted, %d Gaussians stand on them", done.sum(), len(made) - len(field))
    return Completed(made, there, done, len(made) - len(field))


def _ground_colour(field: GaussianField, grid: Ground) -> Float[Array, "3"]:
    """Mean colour of the discs that a photo saw, or of all if none did."""
    seen = grid.seen.ravel() if grid.seen.any() else np.ones(grid.heights.size, bool)
    return np.clip(field.base_colours[: seen.size][seen], 0, 1).mean(0, dtype=float)


def _coloured(
    field: GaussianField,
    todo: Bool[Array, "rows columns"],
    camera: Camera,
    picture: Float32[Array, "s s 3"],
    good: Bool[Array, "s s"],
) -> tuple[GaussianField, Bool[Array, "rows columns"]]:
    """The field with the colours that a picture's good pixels give the discs to do, and the cells that still are."""
    rows, pixels = _in_picture(field, todo, camera, good)
    sh = field.sh.copy()
    sh[rows], sh[rows, :1] = 0, rgb_to_sh(_read_off(picture, pixels))
    left = todo.ravel().copy()
    left[rows] = False
    return replace(field, sh=sh), left.reshape(todo.shape)


def _in_picture(
    field: GaussianField, todo: Bool[Array, "rows columns"], camera: Camera, good: Bool[Array, "s s"]
) -> tuple[Int[Array, "n"], Float[Array, "n 2"]]:
    """The discs of cells that a good pixel shows, and where in the picture they are."""
    rows = np.flatnonzero(todo)
    pixels, depth = camera.project(field.means[rows].astype(float))
    inside = (depth > 0) & (pixels > INSET).all(1) & (pixels < len(good) - INSET).all(1)
    rows, pixels = rows[inside], pixels[inside]
    shown = good[tuple(pixels.astype(int).T[::-1])]
    return rows[shown], pixels[shown]


def _read_off(picture: Float32[Array, "s s 3"], pixels: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
    """Colours at places of a picture, bilinear."""
    at = pixels.T[::-1] - 0.5
    return np.stack([map_coordinates(picture[..., c], at, order=1, mode="nearest") for c in range(3)], 1).astype(float)


def _above_underlay(field: GaussianField, grid: Ground, marked: Bool[Array, "n"]) -> GaussianField:
    """The field with the colours of the marked discs on what of its underlay is marked."""
    rows, n = underlay.find_rows(field, grid), grid.heights.size
    if rows.stop == rows.start:
        return field
    colours = underlay.place_underlay(grid, field.means[:n, 2], field.base_colours[:n])[2]
    under, sh = np.flatnonzero(marked[rows]), field.sh.copy()
    sh[rows.start + under, :1] = rgb_to_sh(colours[under])
    return replace(field, sh=sh)


def _marked(field: GaussianField, marked: Bool[Array, "n"]) -> GaussianField:
    return replace(
        field,
        uncertainty=np.where(marked, np.float32(1), field.uncertainty),
        imagined=field.imagined | marked,
    )


def _standing(
    field: GaussianField,
    grid: Ground,
    frame: SceneFrame,
    known: ReferencePhotos,
    targets: list[Float[Array, "3"]],
    asked: PriorConfig,
) -> list[GaussianField]:
    """What stands on the painted ground about each target."""
    found, size = [], asked.model.size
    for target in progress(targets, "look at it from aside"):
        pool = viewpoints.cameras(viewpoints.ABOVE + viewpoints.ASIDE, target, field, grid, frame, size)
        if len(pool) > 1:
            condition = conditions.build_condition(field, pool, known, frame.flying_height, size)
            nothing = np.zeros((len(pool), size, size), bool)
            made = painted(asked, condition, nothing, _ground_colour(field, grid))
            found.append(occluders.things(field, grid, pool, condition, made, frame.flying_height))
    return found
