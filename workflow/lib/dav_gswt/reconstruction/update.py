"""UPDATE_GS of the paper: from a field and new photos to the next field.

`update_field` fits the field on, to all photos so far. `fit_chosen_photos` fits a new field to them, with as many
steps as the rounds have together: it depends on the photos alone, not on the rounds that they came in, and keeps
nothing that a fit to fewer photos got wrong, but it costs a whole fit in each round.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray as Array
from scipy.spatial import cKDTree

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import discs, objects, observation
from dav_gswt.reconstruction.coarse import Reconstruction, finish_field, fit_coarse_field, read_start_views
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitReport, FitSettings
from dav_gswt.reconstruction.fitting.trainer import FitOptions
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.ground_constraints import GroundConstraints

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class UpdateInput:
    """A field with its ground, and the photos to update it with. earlier: those that it was fitted to."""

    field: GaussianField
    grid: Ground
    frame: SceneFrame
    earlier: list[TrainingView]
    new: list[TrainingView]


@dataclass(frozen=True)
class PhotoFiles:
    """Where photos and their model are; how many photos the first fit had; whether all ground that they show counts."""

    model: Path | str
    images: Path | str
    start: int
    whole: bool


def update_as_preset(
    given: UpdateInput, preset: Mapping[str, Any], files: PhotoFiles, rng: np.random.Generator
) -> Reconstruction:
    """The field of a round, as the preset's `update` says: `continue` or `scratch`."""
    if preset["update"] == "continue":
        return update_field(given, FitSettings.from_preset(preset), rng)
    return fit_chosen_photos(given.earlier + given.new, given.frame, preset, files, rng)


def fit_chosen_photos(
    photos: list[TrainingView],
    frame: SceneFrame,
    preset: Mapping[str, Any],
    files: PhotoFiles,
    rng: np.random.Generator,
) -> Reconstruction:
    """The field of all photos that rounds chose: one fit to all of them, without a look at what contradicts."""
    start = read_start_views(frame, photos, files.model, files.images, files.whole)
    settings = FitSettings.from_preset(preset).from_scratch(files.start, len(photos))
    return fit_coarse_field(start, settings, rng)


def update_field(given: UpdateInput, settings: FitSettings, rng: np.random.Generator) -> Reconstruction:
    """Fit a field on with new photos.

    Ground that only the new photos see takes their colours, and objects that they show where nothing stood are added;
    then all Gaussians are fitted to all photos. Without new photos the field is returned as it is.
    """
    field, grid, new = given.field, given.grid, given.new
    if not new:
        return Reconstruction(field, grid, FitReport(gaussians=len(field)))
    begin, grid, views, constraints = _prepare_start(given, settings, rng)
    plan, options = settings.plan_update(len(given.earlier), len(new)), FitOptions(f"fit {len(new)} new photos")
    fit = trainer.fit_field(begin, views, plan, constraints, rng, options)
    return Reconstruction(*finish_field(fit.field, grid, views), fit.report)


def _prepare_start(
    given: UpdateInput, settings: FitSettings, rng: np.random.Generator
) -> tuple[GaussianField, Ground, list[TrainingView], GroundConstraints]:
    """The field with colours and objects that it lacks, its grid, all photos with weights as the fit takes them, and
    the constraints; the field's first Gaussians stay those of the grid."""
    field, grid, frame = given.field, given.grid, given.frame
    views, relief = observation.observe(frame, grid, given.earlier + given.new)
    occluders = field[grid.heights.size + discs.count_underlay(grid) :]
    added = _drop_near(objects.make_shell(relief, views), occluders, relief.grid.spacing)
    added = observation.thin_at_random(added, settings.max_gaussians - len(field), rng)
    added = added.with_harmonics(field.sh.shape[1])
    _log.info("objects: %d Gaussians where nothing stood", len(added))
    field, occluders = concatenate_fields([field, added]), concatenate_fields([occluders, added])
    colour, known = observation.ground_colours(grid, views, occluders)
    field = replace(field, sh=_colour_cells(field.sh, (known & ~grid.seen).ravel(), colour))
    grid = replace(grid, seen=known)
    masked = observation.mask_for_fit(views, grid)
    return field, grid, masked, observation.make_constraints(grid, relief, occluders, frame)


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
