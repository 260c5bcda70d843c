"""The training loop: gradient descent of a field on the photos.

One photo a step, L1 + D-SSIM, Adam. Behind the field is a random colour (so that dark grains are not modelled by
transparency), or the sky where the photo shows it. Each step first fits the picture's gain and offset, since photos
change exposure. The ground's constraints apply to gradients and parameters.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from dav_gswt import arrays, raster
from dav_gswt.field import GaussianField
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import backends
from dav_gswt.reconstruction.fitting import densification, exposure, state
from dav_gswt.reconstruction.fitting.descent import Descent, TrainingState, TrainingTask
from dav_gswt.reconstruction.fitting.plan import FitPlan, FitReport, Schedule
from dav_gswt.reconstruction.fitting.state import State
from dav_gswt.reconstruction.ground_constraints import GroundConstraints

CHECK_EVERY = 50  # steps: whether all values are finite, all that is read of a GPU between growth events
PROJECT_EVERY = 10  # steps: the constraints' projection of the parameters
MIN_OPACITY = 0.02  # of a free Gaussian at the end of the fit
MIN_PEAK = 0.03  # largest blend weight in any photo, below which a Gaussian is pruned


@dataclass(frozen=True)
class FitResult:
    """A fitted field and the report of the fit.

    kept: which of the last step's Gaussians the field has. If the plan lets none grow, these are the Gaussians of the
    start, row by row.
    """

    field: GaussianField
    report: FitReport
    kept: Bool[Array, "n"] | None = None


@dataclass(frozen=True)
class FitOptions:
    """How a fit runs, which does not change its result.

    name: in the log. callback: called with the step and the state after every `every` steps.
    """

    name: str = "fit"
    callback: Callable[[int, State], None] | None = None
    every: int = 1


DEFAULT_OPTIONS = FitOptions()


def fit_field(
    field: GaussianField,
    views: list[TrainingView],
    plan: FitPlan,
    constraints: GroundConstraints,
    rng: np.random.Generator,
    options: FitOptions = DEFAULT_OPTIONS,
) -> FitResult:
    """Fit a field to views.

    A view's weight says which of its pixels count. Views without any are left out, unless all are: their exposure
    would count as that of a typical photo, and their steps would be lost. There is at least one.
    Returns: the field, its first `constraints.fixed` Gaussians in their order, and the report.
    """
    views = [view for view in one_by_one(views) if view.weight.any()] or views
    begin = state.from_field(field)
    if begin.sh_degree > plan.sh_degree:
        begin.resize_sh(plan.sh_degree)
    run = TrainingState(begin, rng, exposure.ExposureTracker(len(views)))
    task = TrainingTask(views, plan, Schedule(plan, len(field)), constraints, raster.make_rasterizer())
    descent = _choose_descent(task)
    descent.start(run, task)
    for _ in progress(range(plan.steps), options.name):
        _advance(run, task, descent)
        if run.step % CHECK_EVERY == 0 or run.step == plan.steps:
            descent.check(run)
        if options.callback and run.step % options.every == 0:
            options.callback(run.step, run.state.convert(arrays.on_host))
    run.state = run.state.convert(arrays.on_host)
    return _finish(run, task)


def _choose_descent(task: TrainingTask) -> Descent:
    """Steps on the GPU with the backend `cuda`."""
    if backends.select_backend() != "cuda":
        return Descent()
    from dav_gswt.reconstruction.fitting.device_descent import DeviceDescent  # deferred: it needs gsplat

    return DeviceDescent(cast(Any, task.raster))


def _advance(run: TrainingState, task: TrainingTask, descent: Descent) -> None:
    """One step, and what is due after it."""
    if not run.turn:
        run.turn = list(map(int, run.rng.permutation(len(task.views))))
    _raise_sh_degree(run, task)
    descent.descend(run, task, run.turn.pop())
    run.step += 1
    if run.step % PROJECT_EVERY == 0 or run.step == task.plan.steps:
        task.constraints.project_parameters(run.state.values)
    descent.perturb(run, task)
    if task.schedule.to_growth(run.step) == 0:
        _grow(run, task)
        run.errors = None
    if task.schedule.prunes(run.step):
        _prune(run, task, descent)
        run.errors = None


def _raise_sh_degree(run: TrainingState, task: TrainingTask) -> None:
    """The spherical harmonics come one degree after the other, in the first half."""
    due = int(task.plan.sh_degree * min(1.0, 2 * run.step / max(1, task.plan.steps)))
    if due > run.state.sh_degree:
        run.state.resize_sh(due)


def _grow(run: TrainingState, task: TrainingTask) -> None:
    """A growth event: new and relocated Gaussians go where the errors of the last photos are."""
    misplaced = task.constraints.find_misplaced({"means": arrays.on_host(run.state.values["means"])})
    allowed = task.schedule.max_gaussians(run.step, len(run.state))
    assert run.errors is not None  # noted in the steps before
    errors = arrays.on_host(run.errors)
    errors[task.constraints.frozen] = 0
    densification.grow(run.state, task.constraints.fixed, misplaced, errors, allowed, run.rng)


def _prune(run: TrainingState, task: TrainingTask, descent: Descent) -> None:
    """Remove free Gaussians that are hardly visible in any photo: they are a haze that fits each photo's noise."""
    peak = descent.measure_peaks(run, task)
    peak[: task.constraints.fixed] = 1
    run.state.select(np.flatnonzero(peak > MIN_PEAK))


def _finish(run: TrainingState, task: TrainingTask) -> FitResult:
    values = run.state.values
    alive = densification.to_opacity(values["opacity_logits"]) > MIN_OPACITY
    alive &= ~task.constraints.find_misplaced(values)
    alive[: task.constraints.fixed] = True
    field = state.to_field(run.state, task.constraints.discs, alive)
    return FitResult(field, FitReport(run.step, len(field)), alive)
