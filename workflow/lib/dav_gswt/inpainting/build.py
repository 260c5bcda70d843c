"""Inpainting of a field: a prior colours the ground that no photo saw. Seen Gaussians keep their bytes."""

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
from dav_gswt.inpainting.view_inpainting import LEAST_ALPHA, inpaint_views
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.prior import conditions
from dav_gswt.prior.conditions import ReferencePhotos
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views.prior_sampling import PriorConfig

_log = logging.getLogger(__name__)

INSET = 2.0  # pixels along the border of a picture that are not used: the prior knows little of what lies beyond


@dataclass(frozen=True)
class InpaintingResult:
    """A field, the cells that no photo saw, and those of them that were inpainted. objects: number of new Gaussians."""

    field: GaussianField
    unseen: Bool[Array, "rows columns"]
    inpainted: Bool[Array, "rows columns"]
    objects: int

    def describe(self, grid: Ground) -> dict:
        """The content of completion.json; its key `things` counts Gaussians of objects."""
        block = np.s_[grid.first_row : grid.first_row + grid.cells, grid.first_column : grid.first_column + grid.cells]
        counts = {"cells": grid.heights.size, "unseen": int(self.unseen.sum()), "painted": int(self.inpainted.sum())}
        inside = {"unseen": int(self.unseen[block].sum()), "painted": int(self.inpainted[block].sum())}
        return counts | {"things": self.objects, "exemplar": inside, "changed": bool(self.field.imagined.any())}


@dataclass(frozen=True)
class _Scene:
    """Input of all steps. ground_colour: mean colour of the discs that photos saw."""

    grid: Ground
    frame: SceneFrame
    photos: ReferencePhotos
    config: PriorConfig
    ground_colour: Float[Array, "3"]


def inpaint_field(
    field: GaussianField, grid: Ground, frame: SceneFrame, photos: list[TrainingView], config: PriorConfig
) -> InpaintingResult:
    """Inpaint the ground that no photo saw, one picture from above after the other, each conditioned on those before.

    Discs of such ground, and of the underlay under such ground alone, take the generated colours and keep their places,
    since the depth of a prior is rougher than the surface of the ground. Gaussians are added where the depth shows an
    object from two sides (`occluders`). All these are marked `imagined`, with uncertainty 1. Colours are read from the
    pictures without a fit: a picture of 64 pixels is coarser than the discs. The grid is not changed: `seen` remains
    what photos saw. A cell under a known object, which no picture from above shows, keeps its colour unmarked.

    Returns: the field itself, if there is nothing to inpaint or the field has no ground layer.
    Raises: ValueError: see `inpaint_views`.
    """
    cells = unseen.find_unseen_cells(field, grid)
    _log.info("%d of %d cells of the ground were seen by no photo", cells.sum(), cells.size)
    if not cells.any():
        return InpaintingResult(field, cells, cells, 0)
    targets = viewpoints.find_targets(grid, cells, frame.flying_height)
    references = conditions.prepare_photos(photos, frame, config.model.size)
    scene = _Scene(grid, frame, references, config, _mean_ground_colour(field, grid))
    coloured, left = _colour_cells(scene, field, cells, targets)
    done = cells & ~left
    if not done.any():
        _log.info("none of them is visible: known objects cover them all")
        return InpaintingResult(field, cells, done, 0)
    marked = unseen.select_gaussians(field, grid, done)
    ground = _mark_gaussians(_colour_underlay(coloured, grid, marked), marked)
    result = concatenate_fields([ground, *_add_occluders(scene, ground, targets)])
    _log.info("%d cells inpainted, %d Gaussians of objects added", done.sum(), len(result) - len(field))
    return InpaintingResult(result, cells, done, len(result) - len(field))


def _mean_ground_colour(field: GaussianField, grid: Ground) -> Float[Array, "3"]:
    """Mean colour of the discs that a photo saw, or of all if none did."""
    seen = grid.seen.ravel() if grid.seen.any() else np.ones(grid.heights.size, bool)
    return np.clip(field.base_colours[: seen.size][seen], 0, 1).mean(0, dtype=float)


def _colour_cells(
    scene: _Scene, field: GaussianField, cells: Bool[Array, "rows columns"], targets: list[Float[Array, "3"]]
) -> tuple[GaussianField, Bool[Array, "rows columns"]]:
    """The field with generated colours, and the unseen cells that no picture showed."""
    coloured, left, size = field, cells, scene.config.model.size
    for target in progress(targets, "inpaint unseen ground"):
        cameras = viewpoints.place_cameras(viewpoints.ABOVE, target, coloured, scene.grid, scene.frame, size)
        for pose, camera in cameras:
            condition = conditions.build_condition(
                coloured, [(pose, camera)], scene.photos, scene.frame.flying_height, size
            )
            shows, shows_left = (
                unseen.render_share(coloured, unseen.select_gaussians(field, scene.grid, some), camera)
                for some in (cells, left)
            )
            touched = shows_left[None] > unseen.TOUCHED
            views = inpaint_views(scene.config, condition, touched, scene.ground_colour)
            good = (shows > unseen.LOOKS) & (views.alpha[0] > LEAST_ALPHA)
            coloured, left = _colour_discs(coloured, left, camera, views.colour[0], good)
    return coloured, left


def _colour_discs(
    field: GaussianField,
    left: Bool[Array, "rows columns"],
    camera: Camera,
    picture: Float32[Array, "s s 3"],
    good: Bool[Array, "s s"],
) -> tuple[GaussianField, Bool[Array, "rows columns"]]:
    """The field with the colours of a picture's good pixels on the discs of cells that are left, and what is left."""
    rows, pixels = _find_visible(field, left, camera, good)
    sh = field.sh.copy()
    sh[rows], sh[rows, :1] = 0, rgb_to_sh(_sample_picture(picture, pixels))
    still = left.ravel().copy()
    still[rows] = False
    return replace(field, sh=sh), still.reshape(left.shape)


def _find_visible(
    field: GaussianField, cells: Bool[Array, "rows columns"], camera: Camera, good: Bool[Array, "s s"]
) -> tuple[Int[Array, "n"], Float[Array, "n 2"]]:
    """The discs of cells that a good pixel shows, and their pixels."""
    rows = np.flatnonzero(cells)
    pixels, depth = camera.project(field.means[rows].astype(float))
    inside = (depth > 0) & (pixels > INSET).all(1) & (pixels < len(good) - INSET).all(1)
    rows, pixels = rows[inside], pixels[inside]
    visible = good[tuple(pixels.astype(int).T[::-1])]
    return rows[visible], pixels[visible]


def _sample_picture(picture: Float32[Array, "s s 3"], pixels: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
    """Colours of a picture, bilinear."""
    at = pixels.T[::-1] - 0.5
    return np.stack([map_coordinates(picture[..., c], at, order=1, mode="nearest") for c in range(3)], 1).astype(float)


def _colour_underlay(field: GaussianField, grid: Ground, marked: Bool[Array, "n"]) -> GaussianField:
    """The field with the colours of the marked discs on the marked part of its underlay."""
    rows, n = underlay.find_rows(field, grid), grid.heights.size
    if rows.stop == rows.start:
        return field
    colours = underlay.place_underlay(grid, field.means[:n, 2], field.base_colours[:n])[2]
    under, sh = np.flatnonzero(marked[rows]), field.sh.copy()
    sh[rows.start + under, :1] = rgb_to_sh(colours[under])
    return replace(field, sh=sh)


def _mark_gaussians(field: GaussianField, marked: Bool[Array, "n"]) -> GaussianField:
    uncertainty = np.where(marked, np.float32(1), field.uncertainty)
    return replace(field, uncertainty=uncertainty, imagined=field.imagined | marked)


def _add_occluders(scene: _Scene, field: GaussianField, targets: list[Float[Array, "3"]]) -> list[GaussianField]:
    """The objects on the inpainted ground about each target."""
    fields, size, flying_height = [], scene.config.model.size, scene.frame.flying_height
    ground_colour = _mean_ground_colour(field, scene.grid)
    for target in progress(targets, "find objects on it"):
        places = viewpoints.ABOVE + viewpoints.ASIDE
        pool = viewpoints.place_cameras(places, target, field, scene.grid, scene.frame, size)
        if len(pool) > 1:
            condition = conditions.build_condition(field, pool, scene.photos, flying_height, size)
            nothing = np.zeros((len(pool), size, size), bool)
            views = inpaint_views(scene.config, condition, nothing, ground_colour)
            fields.append(occluders.find_occluders(field, scene.grid, pool, condition, views, flying_height))
    return fields
