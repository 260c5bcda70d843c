"""The first field: fitted to the start views and the points of structure from motion, or a finished one prepared."""

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.colmap_model import colour_points, read_colmap_model, triangulate_model
from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction import discs, ground, objects, observation
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitReport, FitSettings, limit_discs
from dav_gswt.reconstruction.fitting.trainer import DEFAULT_OPTIONS, FitOptions
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.top_view import render_top_view

_log = logging.getLogger(__name__)

BAND = 0.1  # flying heights within which points belong to a ground with objects on it
BLOCK = 32  # the exemplar's side is a multiple of it, in cells: six levels halve it five times
MIN_WEIGHT = 0.05  # pixels of blend weight from which a photo counts as seeing a Gaussian
OPAQUE = 0.5  # alpha above which a cell takes its height from a finished field


@dataclass(frozen=True)
class Reconstruction:
    """A field, the grid of its ground, and the report of the fit."""

    field: GaussianField
    grid: Ground
    report: FitReport


@dataclass(frozen=True)
class StartViews:
    """What a field is fitted to.

    points, colours: of structure from motion, from these views alone. margin: ground modelled around the exemplar, as
    a share of its side.
    """

    frame: SceneFrame
    views: list[TrainingView]
    points: Float[Array, "n 3"]
    colours: Float[Array, "n 3"]
    margin: float = ground.MARGIN


def read_start_views(
    frame: SceneFrame, views: list[TrainingView], model_folder: Path | str, images: Path | str, whole: bool
) -> StartViews:
    """Add the points of structure from motion that the views show; photos that it does not know bring none.

    whole: model all ground that the photos show, not just a margin around the exemplar.
    """
    model = read_colmap_model(model_folder)
    part = triangulate_model(model, [view.name for view in views if view.name in set(model.names)])
    colours = colour_points(part, [Path(images) / name for name in part.names])
    return StartViews(frame, views, part.points, colours, ground.WHOLE if whole else ground.MARGIN)


def fit_coarse_field(
    given: StartViews, settings: FitSettings, rng: np.random.Generator, options: FitOptions = DEFAULT_OPTIONS
) -> Reconstruction:
    """Fit a field of the ground and the objects on it to the start views."""
    frame, views, points = given.frame, given.views, given.points
    spacing = settings.spacing * observation.pixel_size(frame, views)
    grid = ground.fit_ground(frame, points, spacing, limit_discs(settings.max_gaussians), BLOCK, given.margin)
    _log.info("discs are %.1f times as wide as `spacing` asks for", grid.spacing / spacing)
    views, relief = observation.observe(frame, grid, views)
    shell = objects.make_shell(relief, views)
    isolated = objects.make_isolated_points(grid, relief, points, given.colours, BAND * frame.flying_height)
    room = settings.max_gaussians - grid.heights.size - discs.count_underlay(grid)
    occluders = observation.thin_at_random(concatenate_fields([isolated, shell]), room, rng)
    colour, known = observation.ground_colours(grid, views, occluders)
    grid = replace(grid, seen=known)
    layer = discs.make_ground_discs(grid, discs.fill_unknown(colour, known))
    start = concatenate_fields([layer, discs.make_underlay(grid, layer), occluders])
    _log.info(
        "ground: %d x %d discs of %.4g %s, %.0f %% seen", *grid.shape, grid.spacing, frame.unit, 100 * known.mean()
    )
    _log.info("objects: %d Gaussians over %.1f %% of the ground", len(occluders), 100 * relief.stands.mean())
    constraints = observation.make_constraints(grid, relief, occluders, frame)
    masked = observation.mask_for_fit(views, grid)
    options = replace(options, name="fit coarse field")
    fit = trainer.fit_field(start, masked, settings.plan_coarse_fit(len(views)), constraints, rng, options)
    return Reconstruction(*finish_field(fit.field, grid, masked), fit.report)


def finish_field(fitted: GaussianField, grid: Ground, views: list[TrainingView]) -> tuple[GaussianField, Ground]:
    """The fitted field with its uncertainty, and the grid with the heights of its discs."""
    field = discs.copy_uncertainty(estimate_uncertainty(fitted, views), grid)
    heights = field.means[: grid.heights.size, 2].reshape(grid.shape).astype(float)
    return field, replace(grid, heights=heights)


def estimate_uncertainty(field: GaussianField, views: list[TrainingView]) -> GaussianField:
    """The field with uncertainty u_i = 1 - max over views of (sum of w_i alpha / sum of w_i), 1 where none sees it.

    This needs no prior. It is near 0 where the surface is closed, as the photos' cameras see it.
    """
    known = np.zeros(len(field), np.float32)
    raster = make_rasterizer()
    pictures = raster.forward_each(to_raster_arrays(field), [view.camera for view in views])
    for view, seen in zip(one_by_one(views), pictures, strict=True):
        maps = np.stack([view.weight * seen.alpha, view.weight], -1).astype(np.float32)
        opaque, weight = raster.contributions(maps).mapped.T
        share = np.where(weight > MIN_WEIGHT, opaque / np.maximum(weight, MIN_WEIGHT), 0)
        known = np.maximum(known, share)
    return replace(field, uncertainty=np.clip(1 - known, 0, 1).astype(np.float32))


def prepare_external_field(field: GaussianField, frame: SceneFrame, max_gaussians: int) -> tuple[GaussianField, Ground]:
    """A finished field cut to its exemplar, and the grid of its surface as seen from above, to make tiles of.

    The grid's spacing follows from the field's Gaussians: a disc is as wide as their median.
    """
    across = np.sort(np.exp(field.log_scales), 1)[:, 1]
    spacing = float(np.median(across)) / discs.WIDTH
    grid = ground.fit_ground(frame, np.zeros((0, 3)), spacing, limit_discs(max_gaussians), BLOCK, margin=0.0)
    inside = field[grid.contains(field.means)]
    inside = replace(inside, ground=np.zeros(len(inside), bool))  # its discs, if any, are of another grid
    maps = render_top_view(inside, grid)
    solid = maps.alpha > OPAQUE
    rows, columns = np.nonzero(solid)
    points = grid.centres.reshape(*grid.shape, 3)[rows, columns]
    points[:, 2] = maps.height[rows, columns]
    grid = replace(grid, seen=solid)
    heights = ground.fit_surface(grid, points[:: max(1, len(points) // 50_000)])
    _log.info("finished field: %d Gaussians over %d x %d cells", len(inside), *grid.shape)
    return inside, replace(grid, heights=heights)
