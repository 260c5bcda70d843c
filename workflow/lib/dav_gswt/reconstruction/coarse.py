"""The coarse field: from the start views and the points of structure from motion to the first Gaussian field."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import discs, ground, objects, underlay
from dav_gswt.reconstruction.fit_settings import CoarseSettings
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.constraints import FreeConstraints
from dav_gswt.reconstruction.fitting.exposure import equalize_exposure
from dav_gswt.reconstruction.fitting.plan import AUTO, FitReport
from dav_gswt.reconstruction.fitting.trainer import DEFAULT_OPTIONS, FitOptions
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.observation import (
    extent_of,
    ground_colours,
    make_constraints,
    mask_for_fit,
    observe,
    pixel_size,
    thin_at_random,
    thin_places,
)
from dav_gswt.reconstruction.opacity_uncertainty import estimate_uncertainty

_log = logging.getLogger(__name__)

BAND = 0.1  # flying heights within which points belong to a ground with objects on it
BLOCK = 32  # the exemplar's side is a multiple of it, in cells: six levels halve it five times
START_SHARE = 0.9  # of the Gaussians that a free fit may have, that it starts with at most
NEIGHBOURS = 12  # of a point on the map
MIN_EXPLAINED = 0.6  # share of the points that a height field must explain, or the scene has no ground
MUCH_WIDER = 2.0  # discs than the preset asks for, from which on the log says so
HALF_SHARE = 0.3  # of the steps at half the resolution, for a scene without a ground


@dataclass(frozen=True)
class Reconstruction:
    """A field, the grid of its ground, and the report of the fit."""

    field: GaussianField
    grid: Ground
    report: FitReport


@dataclass(frozen=True)
class StartViews:
    """What a coarse field is fitted to.

    points, colours: of structure from motion, from these views alone. margin: ground modelled around the exemplar, as
    a share of its side.
    """

    frame: SceneFrame
    views: list[TrainingView]
    points: Float[Array, "n 3"]
    colours: Float[Array, "n 3"]
    margin: float = ground.MARGIN


def fit_coarse_field(
    given: StartViews, settings: CoarseSettings, rng: np.random.Generator, options: FitOptions = DEFAULT_OPTIONS
) -> Reconstruction:
    """Fit a field of the ground and the objects on it to the start views.

    A scene that no height field explains is fitted as free Gaussians.
    """
    frame, views, points = given.frame, given.views, given.points
    spacing = settings.spacing * pixel_size(frame, views)
    grid = ground.fit_ground(frame, points, spacing, settings.max_discs, BLOCK, given.margin)
    _warn_of_wide_discs(grid.spacing / spacing)
    explained = _explained_share(grid, points, frame)
    if explained < MIN_EXPLAINED:
        _log.warning("a height field explains only %.0f %% of the points: free Gaussians instead", 100 * explained)
        return _fit_free_field(given, grid, settings, rng, options)
    scene = observe(frame, grid, views)
    shell = objects.make_shell(scene.relief, scene.views)
    isolated = objects.make_isolated_points(grid, scene.relief, points, given.colours, BAND * frame.flying_height)
    room = settings.gaussian_limit - grid.heights.size - underlay.count_gaussians(grid)
    occluders = thin_at_random(concatenate_fields([isolated, shell]), room, rng)
    colour, known = ground_colours(grid, scene.views, occluders)
    grid = replace(grid, seen=known)
    layer = discs.make_ground_discs(grid, discs.fill_unknown(colour, known))
    start = concatenate_fields([layer, underlay.make_underlay(grid, layer), occluders])
    _log.info(
        "ground: %d x %d discs of %.4g %s, %.0f %% seen", *grid.shape, grid.spacing, frame.unit, 100 * known.mean()
    )
    _log.info("objects: %d Gaussians over %.1f %% of the ground", len(occluders), 100 * scene.relief.stands.mean())
    constraints = make_constraints(grid, scene.relief, occluders, frame)
    plan = settings.plan_coarse_fit(len(views))
    masked = mask_for_fit(scene.views, grid)
    fit = trainer.fit_field(start, masked, plan, constraints, rng, replace(options, name="fit coarse field"))
    return Reconstruction(*finish_field(fit.field, grid, masked), fit.report)


def _warn_of_wide_discs(wider: float) -> None:
    """wider: the discs than the preset asks for, as the ground is large for its number of Gaussians."""
    if wider > MUCH_WIDER:
        _log.warning(
            "the ground is so large that its discs are %.1f times as wide as the preset asks for: for a sharper "
            "terrain give it %.1f times as many Gaussians (max_gaussians), or photos of less ground",
            wider,
            wider**2,
        )


def _fit_free_field(
    given: StartViews, grid: Ground, settings: CoarseSettings, rng: np.random.Generator, options: FitOptions
) -> Reconstruction:
    """Fit Gaussians that no ground holds, for a scene without a ground."""
    plan = settings.plan_coarse_fit(len(given.views), HALF_SHARE)
    start, constraints = _start_from_points(given.points, given.colours, settings, rng)
    real = given.frame.kind == "photos"
    views = equalize_exposure(given.views, thin_places(given.points)) if real else given.views
    fit = trainer.fit_field(start, views, plan, constraints, rng, replace(options, name="fit free field"))
    return Reconstruction(*finish_field(fit.field, grid, views), fit.report)


def finish_field(fitted: GaussianField, grid: Ground, views: list[TrainingView]) -> tuple[GaussianField, Ground]:
    """The fitted field with its uncertainty, and the grid with the heights of its discs."""
    field = underlay.copy_uncertainty(estimate_uncertainty(fitted, views), grid)
    if not field.ground.any():
        return field, grid
    heights = field.means[: grid.heights.size, 2].reshape(grid.shape).astype(float)
    return field, replace(grid, heights=heights)


def _start_from_points(
    points: Float[Array, "n 3"], colours: Float[Array, "n 3"], settings: CoarseSettings, rng: np.random.Generator
) -> tuple[GaussianField, FreeConstraints]:
    """Gaussians as large as the points are apart, for a scene without a ground; of many points some, at random, so that
    the fit has room to grow."""
    room = len(points) if settings.max_gaussians == AUTO else int(START_SHARE * settings.gaussian_limit)
    if len(points) > room:
        kept = np.sort(rng.choice(len(points), room, replace=False))
        points, colours = points[kept], colours[kept]
    apart = np.asarray(cKDTree(points).query(points, k=min(4, len(points)))[0])[:, 1:].mean(1)
    start = objects.make_blobs(points, colours, np.clip(0.5 * apart, 1e-6, None), logit=0.0)
    return start, FreeConstraints(float(np.median(apart)), extent_of(points))


def _explained_share(grid: Ground, points: Float[Array, "n 3"], frame: SceneFrame) -> float:
    """Share of the points over the grid that lie near the median height of their neighbours; 1 with too few to tell.

    The fitted surface cannot tell: between few points it bends to all of them.
    """
    inside = points[grid.contains(points)]
    if len(inside) <= NEIGHBOURS:
        return 1.0
    near = np.asarray(cKDTree(inside[:, :2]).query(inside[:, :2], k=NEIGHBOURS + 1)[1])[:, 1:]
    apart = np.abs(inside[:, 2] - np.median(inside[near, 2], axis=1))
    return float((apart < BAND * frame.flying_height).mean())
