"""UPDATE_GS of the paper: from a field and new photos to the next field."""

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import objects, regression_guard, underlay
from dav_gswt.reconstruction.coarse import Reconstruction, finish_field
from dav_gswt.reconstruction.fit_settings import UpdateSettings
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.constraints import Constraints, FreeConstraints
from dav_gswt.reconstruction.fitting.exposure import equalize_exposure
from dav_gswt.reconstruction.fitting.plan import FitPlan
from dav_gswt.reconstruction.fitting.trainer import FitOptions
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.observation import (
    extent_of,
    ground_colours,
    make_constraints,
    mask_for_fit,
    observe,
    thin_at_random,
    thin_places,
)

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RefinementInput:
    """A field with its ground, and the photos to refine it with. earlier: those that it was fitted to."""

    field: GaussianField
    grid: Ground
    frame: SceneFrame
    earlier: list[TrainingView]
    new: list[TrainingView]


def refine_field(
    given: RefinementInput, settings: UpdateSettings, rng: np.random.Generator, snapshots: Path | str | None = None
) -> Reconstruction:
    """Refine a field with new photos.

    Ground that only the new photos see takes their colours, and objects that they show where nothing stood are added;
    then all Gaussians are fitted to all photos. New photos that contradict the earlier ones change nothing (see
    `regression_guard`); without new photos the field is returned as it is.
    """
    field, grid, new = given.field, given.grid, given.new
    if not new:
        return Reconstruction(field, grid, regression_guard.report_unchanged(field))
    start = _prepare_start(given, settings, rng)
    options = FitOptions(f"fit {len(new)} new photos", snapshots)

    def fit(begin: GaussianField, plan: FitPlan) -> trainer.FitResult:
        return trainer.fit_field(begin, start.views, plan, start.constraints, rng, options)

    n = len(given.earlier)
    plan = settings.plan_update(field, n, len(new))
    update = regression_guard.fit_with_guard(field, start.field, start.views[:n], start.views[n:], plan, fit)
    if not update.accepted:
        return Reconstruction(field, grid, update.report)
    return Reconstruction(*finish_field(update.field, start.grid, start.views), update.report)


@dataclass(frozen=True)
class _Start:
    """What the fit of an update starts from. views: all photos, with weights as the fit takes them."""

    field: GaussianField
    grid: Ground
    views: list[TrainingView]
    constraints: Constraints


def _prepare_start(given: RefinementInput, settings: UpdateSettings, rng: np.random.Generator) -> _Start:
    """The field with colours and objects that it lacks; its first Gaussians stay those of the grid."""
    field, grid, frame, views = given.field, given.grid, given.frame, given.earlier + given.new
    if not field.ground.any():
        constraints = FreeConstraints(float(np.exp(np.median(field.log_scales))), extent_of(field.means))
        if frame.kind == "photos":
            views = equalize_exposure(views, thin_places(field.means.astype(float)))
        return _Start(field, grid, views, constraints)
    scene = observe(frame, grid, views)
    occluders = field[grid.heights.size + underlay.count_gaussians(grid) :]
    shell = objects.make_shell(scene.relief, scene.views)
    added = _drop_near(shell, occluders, scene.relief.grid.spacing)
    added = _match_degree(thin_at_random(added, settings.gaussian_limit - len(field), rng), field)
    _log.info("objects: %d Gaussians where nothing stood", len(added))
    field, occluders = concatenate_fields([field, added]), concatenate_fields([occluders, added])
    colour, known = ground_colours(grid, scene.views, occluders)
    field = replace(field, sh=_colour_cells(field.sh, (known & ~grid.seen).ravel(), colour))
    grid = replace(grid, seen=known)
    masked = mask_for_fit(scene.views, grid)
    return _Start(field, grid, masked, make_constraints(grid, scene.relief, occluders, frame))


def _colour_cells(sh: Array, cells: Array, colour: Array) -> Array:
    """Coefficients with the discs of some cells in their colours."""
    sh = sh.copy()
    sh[: cells.size, :1][cells] = rgb_to_sh(colour[cells])
    return sh


def _drop_near(part: GaussianField, others: GaussianField, distance: float) -> GaussianField:
    """The Gaussians of a part that are farther from all others."""
    if not len(others) or not len(part):
        return part
    return part[np.asarray(cKDTree(others.means).query(part.means)[0]) > distance]


def _match_degree(part: GaussianField, field: GaussianField) -> GaussianField:
    """A part with as many colour coefficients as the field has; the new ones are 0."""
    sh = np.zeros((len(part), *field.sh.shape[1:]), np.float32)
    sh[:, :1] = part.sh[:, :1]
    return replace(part, sh=sh)
