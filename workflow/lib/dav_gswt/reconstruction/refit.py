"""A round's field from scratch: one fit to all photos so far, with as many steps as the rounds have together.

It depends on the photos alone, not on the rounds that they came in: nothing that a fit to fewer photos got wrong is
kept, as an update keeps it. With `refit: scratch` it costs a whole fit a round; with `choose_with` one in all, as the
rounds are another preset's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.colmap_model import read_colmap_model, triangulate_points
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction import ground, regression_guard
from dav_gswt.reconstruction.coarse import Reconstruction, StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings, select_settings
from dav_gswt.reconstruction.fitting.plan import FitPlan, UpdateReport
from dav_gswt.reconstruction.fitting.trainer import FitOptions, FitResult
from dav_gswt.reconstruction.observation import mask_for_fit
from dav_gswt.reconstruction.refinement import RefinementInput, refine_field


@dataclass(frozen=True)
class ScratchSettings:
    """start: photos of the first fit."""

    coarse: CoarseSettings
    update: UpdateSettings
    start: int

    def for_photos(self, count: int) -> CoarseSettings:
        """The settings of a fit to so many photos."""
        steps = self.coarse.plan_coarse_fit(self.start).steps
        more = self.update.steps_per_new_photo * max(0, count - self.start)
        return replace(self.coarse, steps=steps + more, steps_per_photo=0)


@dataclass(frozen=True)
class MatchedPoints:
    """Points of structure from motion, from the photos so far, and the ground modelled around the exemplar."""

    points: Float[Array, "n 3"]
    colours: Float[Array, "n 3"]
    margin: float


@dataclass(frozen=True)
class PhotoFiles:
    """Where photos and their model are; how many photos the first fit had; whether all ground that they show counts."""

    model: Path | str
    images: Path | str
    start: int
    whole: bool


def update_field(
    given: RefinementInput,
    preset: Mapping[str, Any],
    files: PhotoFiles,
    rng: np.random.Generator,
    snapshots: Path | str | None = None,
) -> Reconstruction:
    """The field of a round, as the preset's `refit` says."""
    update = select_settings(UpdateSettings, preset)
    if preset["refit"] == "continue":
        return refine_field(given, update, rng, snapshots)
    settings = select_scratch_settings(preset, files.start)
    return refit_from_scratch(given, match_points(given.earlier + given.new, files), settings, rng, snapshots)


def fit_chosen_photos(
    photos: list[TrainingView],
    frame: SceneFrame,
    preset: Mapping[str, Any],
    files: PhotoFiles,
    rng: np.random.Generator,
    snapshots: Path | str | None = None,
) -> Reconstruction:
    """The field of photos that another preset's rounds chose: one fit to all of them."""
    settings = select_scratch_settings(preset, files.start)
    start = _start_from(photos, frame, match_points(photos, files))
    return fit_coarse_field(start, settings.for_photos(len(photos)), rng, FitOptions(snapshots=snapshots))


def select_scratch_settings(preset: Mapping[str, Any], start: int) -> ScratchSettings:
    """The settings of fits from scratch from a preset. start: photos of the first fit."""
    return ScratchSettings(select_settings(CoarseSettings, preset), select_settings(UpdateSettings, preset), start)


def match_points(views: list[TrainingView], files: PhotoFiles) -> MatchedPoints:
    """The points that the photos show which structure from motion knows: a replay's are among them, others are not."""
    model = read_colmap_model(files.model)
    known = [view.name for view in views if view.name in set(model.names)]
    points, colours = triangulate_points(model, known, files.images)
    return MatchedPoints(points, colours, ground.WHOLE if files.whole else ground.MARGIN)


def refit_from_scratch(
    given: RefinementInput,
    matched: MatchedPoints,
    settings: ScratchSettings,
    rng: np.random.Generator,
    snapshots: Path | str | None = None,
) -> Reconstruction:
    """Fit a field to the earlier and the new photos.

    New photos that contradict the earlier ones change nothing; without new photos the field is returned as it is.
    A fit from scratch shows earlier photos worse than a fit to them alone did, on rich ground by more than the guard's
    bound: whether photos contradict each other is then told by an update, as `refine_field` makes it.
    """
    field, grid, count = given.field, given.grid, len(given.earlier)
    if not given.new:
        return Reconstruction(field, grid, regression_guard.report_unchanged(field))
    photos = given.earlier + given.new
    coarse = settings.for_photos(len(photos))
    start = _start_from(photos, given.frame, matched)
    made: list[Reconstruction] = []

    def fit(begin: GaussianField, plan: FitPlan) -> FitResult:
        made.append(fit_coarse_field(start, coarse, rng, FitOptions(snapshots=snapshots)))
        return FitResult(made[-1].field, made[-1].report)

    def is_update_accepted() -> bool:
        report = refine_field(given, settings.update, rng.spawn(1)[0]).report
        return isinstance(report, UpdateReport) and bool(report.new_views and report.new_views.taken)

    seen = mask_for_fit(photos, grid)
    plan = coarse.plan_coarse_fit(len(photos))
    update = regression_guard.fit_with_guard(field, field, seen[:count], seen[count:], plan, fit, 0, is_update_accepted)
    if not update.accepted:
        return Reconstruction(field, grid, update.report)
    return replace(made[-1], report=update.report)


def _start_from(photos: list[TrainingView], frame: SceneFrame, matched: MatchedPoints) -> StartViews:
    return StartViews(frame, photos, matched.points, matched.colours, matched.margin)
