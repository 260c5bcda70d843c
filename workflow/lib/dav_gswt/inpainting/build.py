"""Inpainting of a field: a prior colours the ground that no photo saw. Seen Gaussians keep their bytes."""

import logging
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter, map_coordinates

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.prior import interface
from dav_gswt.prior.interface import Condition
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.threads import one_thread
from dav_gswt.views import candidates
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.scoring import PriorConfig

if TYPE_CHECKING:
    import dav_gswt.prior.terrain

_log = logging.getLogger(__name__)

BLOCK = 0.4  # flying heights: side of the ground under one camera, whose picture shows 0.7
ELEVATION, RADIUS = 80.0, 0.7  # degrees, flying heights: nearly from above, so that the picture's top is defined
FIELD_OF_VIEW = 55.0  # degrees, as of the prior's training examples
INSET = 2.0  # pixels along the border of a picture that are not used: the prior knows little of what lies beyond
LEAST_UNCERTAINTY = 0.5  # of a disc that no photo fitted
TOUCHED = 0.1  # share of a pixel's blend weight from which the pixel shows something of certain Gaussians
LOOKS = 0.5  # share of a pixel's blend weight from which the pixel looks at certain Gaussians
CELL = 4  # pixels per side of a cell of the latent, the unit of the mask of valid pixels
SPREAD = 0.1  # pictures: how far a colour difference at the border of unseen pixels reaches into them
FAR_WEIGHT = 0.05  # of the ground's mean colour, which prevails far from known pixels
LEAST_ALPHA = 0.5  # by which a colour over black is divided, at least


@dataclass(frozen=True)
class InpaintingResult:
    """A field, the cells that no photo saw, and those of them that were inpainted."""

    field: GaussianField
    unseen: Bool[Array, "rows columns"]
    inpainted: Bool[Array, "rows columns"]

    def describe(self, grid: Ground) -> dict:
        """The content of completion.json."""
        block = np.s_[grid.first_row : grid.first_row + grid.cells, grid.first_column : grid.first_column + grid.cells]
        counts = {"cells": grid.heights.size, "unseen": int(self.unseen.sum()), "painted": int(self.inpainted.sum())}
        inside = {"unseen": int(self.unseen[block].sum()), "painted": int(self.inpainted[block].sum())}
        return counts | {"exemplar": inside, "changed": bool(self.field.imagined.any())}


def inpaint_field(
    field: GaussianField, grid: Ground, frame: SceneFrame, photos: list[TrainingView], config: PriorConfig
) -> InpaintingResult:
    """Inpaint the ground that no photo saw, one picture from above after the other, each conditioned on those before.

    Discs of such ground, and of the underlay under such ground alone, take the generated colours and keep their places,
    since the depth of a prior is rougher than the surface of the ground. They are marked `imagined`, with uncertainty
    1. Colours are read from the pictures without a fit: a picture of 64 pixels is coarser than the discs. The grid is
    not changed: `seen` remains what photos saw. A cell under a known object, which no picture from above shows, keeps
    its colour unmarked.

    Returns: the field itself, if there is nothing to inpaint or the field has no ground layer.
    Raises: ValueError: see `inpaint_view`.
    """
    cells = find_unseen_cells(field, grid)
    _log.info("%d of %d cells of the ground were seen by no photo", cells.sum(), cells.size)
    if not cells.any():
        return InpaintingResult(field, cells, cells)
    size, height = config.model.size, frame.flying_height
    references = interface.prepare_photos(photos, frame, size)
    seen = grid.seen.ravel() if grid.seen.any() else np.ones(cells.size, bool)
    ground_colour = np.clip(field.base_colours[: cells.size][seen], 0, 1).mean(0, dtype=float)
    coloured, left = field, cells  # the cells that no picture showed
    for target in progress(find_targets(grid, cells, height), "inpaint unseen ground"):
        for pose, camera in place_camera(target, coloured, grid, frame, size):
            condition = interface.build_condition(coloured, [(pose, camera)], references, height, size)
            shows, shows_left = (
                render_share(coloured, select_gaussians(field, grid, some), camera) for some in (cells, left)
            )
            picture, alpha = inpaint_view(config, condition, shows_left > TOUCHED, ground_colour)
            good = (shows > LOOKS) & (alpha > LEAST_ALPHA)
            coloured, left = _colour_discs(coloured, left, camera, picture, good)
    done = cells & ~left
    if not done.any():
        _log.info("none of them is visible: known objects cover them all")
        return InpaintingResult(field, cells, done)
    marked = select_gaussians(field, grid, done)
    coloured = _colour_underlay(coloured, grid, marked)
    uncertainty = np.where(marked, np.float32(1), field.uncertainty)
    result = replace(coloured, uncertainty=uncertainty, imagined=field.imagined | marked)
    _log.info("%d cells inpainted", done.sum())
    return InpaintingResult(result, cells, done)


def _colour_discs(
    field: GaussianField,
    left: Bool[Array, "rows columns"],
    camera: Camera,
    picture: Float32[Array, "s s 3"],
    good: Bool[Array, "s s"],
) -> tuple[GaussianField, Bool[Array, "rows columns"]]:
    """The field with the colours of a picture's good pixels on the discs of cells that are left, and what is left."""
    rows = np.flatnonzero(left)
    pixels, depth = camera.project(field.means[rows].astype(float))
    inside = (depth > 0) & (pixels > INSET).all(1) & (pixels < len(good) - INSET).all(1)
    rows, pixels = rows[inside], pixels[inside]
    visible = good[tuple(pixels.astype(int).T[::-1])]
    rows, at = rows[visible], pixels[visible].T[::-1] - 0.5
    colours = [map_coordinates(picture[..., c], at, order=1, mode="nearest") for c in range(3)]  # bilinear
    sh, still = field.sh.copy(), left.ravel().copy()
    sh[rows], sh[rows, :1] = 0, rgb_to_sh(np.stack(colours, 1).astype(float))
    still[rows] = False
    return replace(field, sh=sh), still.reshape(left.shape)


def _colour_underlay(field: GaussianField, grid: Ground, marked: Bool[Array, "n"]) -> GaussianField:
    """The field with the colours of the marked discs on the marked part of its underlay."""
    rows, n = discs.find_underlay(field, grid), grid.heights.size
    if rows.stop == rows.start:
        return field
    colours = discs.place_underlay(grid, field.means[:n, 2], field.base_colours[:n])[2]
    under, sh = np.flatnonzero(marked[rows]), field.sh.copy()
    sh[rows.start + under, :1] = rgb_to_sh(colours[under])
    return replace(field, sh=sh)


def find_targets(grid: Ground, cells: Bool[Array, "rows columns"], flying_height: float) -> list[Float[Array, "3"]]:
    """The centroid of the marked cells in each block of a lattice over the grid.

    Blocks with few marked cells come first: they have most known ground around them.
    """
    centres = grid.centres[cells.ravel()]
    at = np.floor((centres[:, :2] - [grid.west, grid.south]) / (BLOCK * flying_height)).astype(int)
    _, block, count = np.unique(at, axis=0, return_inverse=True, return_counts=True)
    return [centres[block.ravel() == i].mean(0) for i in np.argsort(count, kind="stable")]


def place_camera(
    target: Float[Array, "3"], field: GaussianField, grid: Ground, frame: SceneFrame, size: int
) -> Candidates:
    """The camera above a target; none if it were in an object or underground."""
    distance = RADIUS * frame.flying_height
    camera = camera_layouts.orbit(ELEVATION, 0.0, distance, target, size, size, FIELD_OF_VIEW)
    centre = camera.centre[None]
    below = grid.contains(centre) & (centre[:, 2] <= grid.height_at(centre))
    if below.any() or candidates.find_inside_objects(centre, field).any():
        return []
    return [(pose_of_camera("virtual", camera, frame), camera)]


def find_unseen_cells(field: GaussianField, grid: Ground) -> Bool[Array, "rows columns"]:
    """The cells that no photo saw: not `seen` when the ground was coloured, and still uncertain after the fit.

    The grid alone would include cells that were occluded before the fit, which often removes the occluder. No cell if
    the field has no ground layer.
    """
    n = grid.heights.size
    if not field.ground[:n].any():
        return np.zeros(grid.shape, bool)
    return ~grid.seen & (field.uncertainty[:n] > LEAST_UNCERTAINTY).reshape(grid.shape)


def select_gaussians(field: GaussianField, grid: Ground, cells: Bool[Array, "rows columns"]) -> Bool[Array, "n"]:
    """The discs of some cells, and the discs of the underlay that lie under such cells alone."""
    marked = np.zeros(len(field), bool)
    marked[: cells.size] = cells.ravel()
    rows, s = discs.find_underlay(field, grid), discs.STRIDE
    if rows.stop > rows.start:
        even = np.pad(cells, [(0, -size % s) for size in cells.shape], constant_values=True)
        blocks = even.reshape(even.shape[0] // s, s, even.shape[1] // s, s).all((1, 3))
        marked[rows] = blocks.ravel()
    return marked


def render_share(field: GaussianField, marked: Bool[Array, "n"], camera: Camera) -> Float32[Array, "h w"]:
    """The share of marked Gaussians in the blend weight of every pixel; 0 in empty pixels."""
    render = make_rasterizer().forward(**to_raster_arrays(field, marked.astype(np.float32)[:, None]), camera=camera)
    return np.clip(render.colour[..., 0], 0, 1)


def inpaint_view(
    config: PriorConfig, condition: Condition, unseen: Bool[Array, "s s"], ground: Float[Array, "3"]
) -> tuple[Float32[Array, "s s 3"], Float32[Array, "s s"]]:
    """Colours as if opaque, and opacity, of one view: the mean of a prior's samples after `match_colours`.

    The samples have no dropout, each starts from its own noise. Their mean is less sharp than one sample, but invents
    less.

    Args:    config: of the terrain prior; no other prior takes a mask of valid cells. condition: of one view. unseen:
             pixels that show what no photo saw; cells with such a pixel are not valid. ground: mean colour of the
             ground that photos saw.
    Raises:  ValueError: the prior gives something that is not finite.
    """
    model = cast("dav_gswt.prior.terrain.TerrainPrior", config.model)
    size = len(unseen)
    touched = unseen.reshape(size // CELL, CELL, size // CELL, CELL).any((1, 3))
    with one_thread():
        known = np.logical_not(touched)[None]
        latents = model.sample(condition, config.samples, 0.0, config.steps, config.seed, known=known, common=False)
        rgba = model.decode(latents)[0].mean(0, dtype=np.float32)
    if not np.isfinite(rgba).all():
        raise ValueError("the prior's picture of a view is not finite")
    alpha, render = rgba[..., 3], condition.colour[0]
    colour = rgba[..., :3] / np.maximum(alpha, LEAST_ALPHA)[..., None]
    certain = ~unseen & (condition.alpha[0] > 0.9)
    return match_colours(colour, render, certain, unseen, ground), alpha


def match_colours(
    picture: Float32[Array, "s s 3"],
    render: Float32[Array, "s s 3"],
    known: Bool[Array, "s s"],
    unseen: Bool[Array, "s s"],
    ground: Float[Array, "3"],
) -> Float32[Array, "s s 3"]:
    """Shift the colours of a picture to those of the render in known pixels, without a drift between pictures.

    The shift is a Gaussian-weighted mean (SPREAD pictures wide) of the differences in known pixels; far from all of
    them it moves the mean of the unseen pixels to the colour of the ground. known and unseen are disjoint; other pixels
    (the sky) are in neither.
    """
    sigma, difference = SPREAD * len(known), (render - picture).astype(float)
    if unseen.any():
        far = ground - picture[unseen].mean(0, dtype=float)
    else:
        far = difference[known].sum(0) / max(1, known.sum())
    near = gaussian_filter(known.astype(float), sigma, mode="nearest")
    sums = [gaussian_filter(known * difference[..., c], sigma, mode="nearest") for c in range(3)]
    shift = (np.stack(sums, -1) + FAR_WEIGHT * far) / (near + FAR_WEIGHT)[..., None]
    return np.clip(picture + shift, 0, 1).astype(np.float32)
