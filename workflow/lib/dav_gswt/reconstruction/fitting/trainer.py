"""The training loop: gradient descent of a field on the photos.

One photo a step, L1 + D-SSIM, Adam. Behind the field is a random colour (so that dark grains are not modelled by
transparency), or the sky where the photo shows it. Each step first fits the picture's gain and offset, since photos
change exposure. The scene's `constraints.Constraints` apply to gradients and parameters.
"""

import inspect
import logging
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.code_digest import digest_code
from dav_gswt.field import GaussianField
from dav_gswt.images import channels, image_files
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView, make_training_view, one_by_one
from dav_gswt.raster import backends
from dav_gswt.reconstruction.fitting import (
    densification,
    exposure,
    held_out,
    pose_refinement,
    sh_degree,
    snapshot,
    state,
)
from dav_gswt.reconstruction.fitting.constraints import Constraints
from dav_gswt.reconstruction.fitting.descent import (
    Descent,
    HostDescent,
    TrainingState,
    TrainingTask,
    background,
    on_host,
)
from dav_gswt.reconstruction.fitting.plan import AUTO, FitPlan, FitReport
from dav_gswt.reconstruction.fitting.residual import Residual
from dav_gswt.reconstruction.fitting.schedule import VISIBLE, Schedule
from dav_gswt.reconstruction.fitting.state import State

_log = logging.getLogger(__name__)

PROJECT_EVERY = 10  # steps: the constraints' projection of the parameters
MIN_OPACITY = 0.02  # of a free Gaussian at the end of the fit
MIN_PEAK = 0.03  # largest blend weight in any photo, below which a Gaussian is pruned


@dataclass(frozen=True)
class FitResult:
    """A fitted field and the report of the fit.

    kept: which of the last step's Gaussians the field has; of a plan that lets none grow these are the start's, row by
    row. None: not told.
    """

    field: GaussianField
    report: FitReport
    kept: Bool[Array, "n"] | None = None


@dataclass(frozen=True)
class FitOptions:
    """How a fit runs, which does not change its result.

    name: in the log. snapshots: a folder; a fit that was killed and is called again with the same arguments continues
    from there. callback: called with the step and the state after every `every` steps.
    """

    name: str = "fit"
    snapshots: Path | str | None = None
    callback: Callable[[int, State], None] | None = None
    every: int = 1


DEFAULT_OPTIONS = FitOptions()


def fit_field(
    field: GaussianField,
    views: list[TrainingView],
    plan: FitPlan,
    constraints: Constraints,
    rng: np.random.Generator,
    options: FitOptions = DEFAULT_OPTIONS,
) -> FitResult:
    """Fit a field to views.

    A view's weight says which of its pixels count. Views without any are left out, unless all are: their exposure
    would count as that of a typical photo, and their steps would be lost.
    Returns: the field, its first `constraints.fixed` Gaussians in their order, and the report.
    Raises: ValueError: no view.
    """
    if not views:
        raise ValueError("a fit needs at least one view")
    what, folder = options.name, options.snapshots
    views = _leave_out_blind(views, what)
    store = snapshot.SnapshotStore(folder, _digest(field, views, plan, constraints, rng) if folder else "")
    run = _start_training(field, views, plan, rng)
    task = _make_task(len(field), views, plan, constraints, np.random.default_rng(len(views)))
    if stored := store.load():
        _resume(run, *stored)
        _log.info("%s: goes on from step %d", what, run.step)
    descent = _choose_descent(task)
    descent.push(run)
    for _ in progress(range(run.step, plan.steps), what):
        _advance(run, task, descent)
        if options.callback and run.step % options.every == 0:
            descent.pull(run)
            options.callback(run.step, run.state)
        if store.due():
            descent.pull(run)
            store.save(*_to_snapshot(run))
    descent.pull(run)
    store.clear()
    return _finish(run, task, what)


def _leave_out_blind(views: list[TrainingView], what: str) -> list[TrainingView]:
    """The views with a pixel that counts; all, if none has one."""
    seeing = [view for view in one_by_one(views) if view.weight.any()]
    if seeing and len(seeing) < len(views):
        _log.info(
            "%s: %d of %d photos have no pixel that counts and are left out", what, len(views) - len(seeing), len(views)
        )
    return seeing or views


def _choose_descent(task: TrainingTask) -> Descent:
    """Steps on the GPU with the backend `cuda`."""
    if backends.select_backend() != "cuda":
        return HostDescent()
    from dav_gswt.reconstruction.fitting.device_descent import DeviceDescent  # deferred: it needs gsplat

    return DeviceDescent(cast(Any, task.raster))


def _start_training(
    field: GaussianField, views: list[TrainingView], plan: FitPlan, rng: np.random.Generator
) -> TrainingState:
    begin = state.from_field(field)
    if begin.sh_degree > plan.max_sh_degree:
        begin.resize_sh(plan.max_sh_degree)
    exposures = exposure.ExposureTracker(len(views))
    return TrainingState(
        begin, FitReport(), rng, exposures, pose_refinement.PoseCorrections(len(views)), Residual(), []
    )


def _make_task(
    start: int, views: list[TrainingView], plan: FitPlan, constraints: Constraints, rng: np.random.Generator
) -> TrainingTask:
    held = (
        [held_out.draw_mask(v.image.shape[0], v.image.shape[1], rng) for v in views] if plan.sh_degree == AUTO else None
    )
    halves = [_halve(v) for v in one_by_one(views)] if plan.half_share else []
    return TrainingTask(views, halves, held, plan, Schedule(plan, start), constraints, raster.Rasterizer())


def _halve(view: TrainingView) -> TrainingView:
    """A view at half its size."""
    half = make_training_view(view.name, view.camera, view.image, max(view.camera.width, view.camera.height) // 2)
    width, height = half.camera.width, half.camera.height
    weight = image_files.shrink_image(view.weight[..., None], width, height)[..., 0]
    rows, columns = ((np.arange(n) + 0.5) * of // n for n, of in zip((height, width), view.weight.shape, strict=True))
    behind = None if view.behind is None else view.behind[rows.astype(int)][:, columns.astype(int)]
    half = replace(half, arrays=view.arrays)
    half = half.with_pixels(image=half.image, weight=np.ascontiguousarray(weight, np.float32))
    return half if behind is None else half.with_pixels(behind=behind)


def _advance(run: TrainingState, task: TrainingTask, descent: Descent) -> None:
    """One step, and what is due after it."""
    if not run.turn:
        run.turn = list(map(int, run.rng.permutation(len(task.views))))
    _raise_sh_degree(run, task, descent)
    descent.descend(run, task, run.turn.pop())
    run.step += 1
    if run.step % PROJECT_EVERY == 0 or run.step == task.plan.steps:
        with on_host(descent, run, ("values",)):
            task.constraints.project_parameters(run.state.values)
    descent.perturb(run, task)
    grows, prunes = task.schedule.to_growth(run.step) == 0, task.schedule.prunes(run.step)
    if grows or prunes:
        with on_host(descent, run):
            if grows:
                _grow(run, task)
            if prunes:
                _prune(run, task)


def _raise_sh_degree(run: TrainingState, task: TrainingTask, descent: Descent) -> None:
    """The spherical harmonics come one degree after the other, in the first half."""
    due = int(task.plan.max_sh_degree * min(1.0, 2 * run.step / max(1, task.plan.steps)))
    if due > run.state.sh_degree:
        with on_host(descent, run):
            run.state.resize_sh(due)


def _grow(run: TrainingState, task: TrainingTask) -> None:
    """A growth event: new and relocated Gaussians go where the errors of the last photos are."""
    misplaced = task.constraints.find_misplaced(run.state.values)
    allowed = task.schedule.max_gaussians(run.step, len(run.state), run.residual.error_per_photo)
    densification.grow(run.state, task.constraints.fixed, misplaced, run.residual.errors, allowed, run.rng)
    run.residual = Residual()


def _prune(run: TrainingState, task: TrainingTask) -> None:
    """Remove free Gaussians that are hardly visible in any photo: they are a haze that fits each photo's noise."""
    peak = np.zeros(len(run.state), np.float32)
    for index, view in enumerate(task.views):
        task.raster.forward(**run.state.values, camera=run.poses.correct(index, view.camera))
        peak = np.maximum(peak, task.raster.contributions().maximum)
    peak[: task.constraints.fixed] = 1
    run.state.select(np.flatnonzero(peak > MIN_PEAK))
    run.residual = Residual()


def _score(run: TrainingState, task: TrainingTask, now: State) -> float:
    """PSNR of the held-out pixels of all photos."""
    assert task.held is not None
    tally = held_out.ErrorSum()
    for index, view in enumerate(one_by_one(task.views)):
        seen = task.raster.forward(**now.values, camera=run.poses.correct(index, view.camera))
        a, b = run.exposures.gain_and_offset(index)
        behind = background(view, np.full(3, 0.5, np.float32))
        picture = channels.scale_channels(channels.composite(seen.colour, seen.alpha, behind), a, b)
        tally.add(picture, view.image, view.weight * task.held[index])
    return tally.psnr


def _finish(run: TrainingState, task: TrainingTask, what: str) -> FitResult:
    if task.held is not None:
        cameras = [view.camera for view in task.views]
        run.state = sh_degree.choose_degree(run.state, cameras, lambda now: _score(run, task, now), run.report)
    values = run.state.values
    alive = densification.to_opacity(values["opacity_logits"]) > MIN_OPACITY
    alive &= ~task.constraints.find_misplaced(values)
    alive[: task.constraints.fixed] = True
    field = state.to_field(run.state, task.constraints.discs, alive)
    if task.plan.max_gaussians == AUTO:
        run.report.note_choice("cap", len(field), f"as many as {VISIBLE:g} of error in a pixel ask for")
    run.report.steps, run.report.gaussians, run.report.degree = run.step, len(field), run.state.sh_degree
    for choice in run.report.choices:
        _log.info("%s: %s is %s: %s", what, choice["what"], choice["value"], choice["why"])
    return FitResult(field, run.report, alive)


def _digest(
    field: GaussianField, views: list[TrainingView], plan: FitPlan, constraints: Constraints, rng: np.random.Generator
) -> str:
    """Digest of all that a fit's result depends on: its arguments, the code that it runs, and the backend."""
    code = [digest_code(Path(file)) for file in (__file__, inspect.getfile(type(constraints)))]
    arrays = [a for v in views for a in (v.image, v.weight, v.behind, v.camera.rotation, v.camera.translation)]
    numbers = [(v.camera.fx, v.camera.fy, v.camera.cx, v.camera.cy) for v in views]
    inputs = field, *arrays, numbers, plan, constraints, rng.bit_generator.state
    return snapshot.digest_inputs(code, backends.describe_backend(), *inputs)


def _to_snapshot(run: TrainingState) -> tuple[dict[str, Array], dict]:
    arrays = {f"{part}.{name}": a for part, of in vars(run.state).items() for name, a in of.items()}
    for prefix, part in _parts(run).items():
        arrays |= {prefix + name: a for name, a in vars(part).items()}
    rest = {"report": asdict(run.report), "rng": run.rng.bit_generator.state}
    return arrays, rest | {"turn": run.turn, "step": run.step}


def _parts(run: TrainingState) -> dict[str, Any]:
    """The parts stored array by array, by the prefix of their names."""
    return {"level.": run.exposures, "pose.": run.poses, "residual.": run.residual}


def _resume(run: TrainingState, arrays: dict[str, Array], rest: dict) -> None:
    run.state = State(**{part: {k: arrays[f"{part}.{k}"] for k in state.NAMES} for part in vars(run.state)})
    for prefix, part in _parts(run).items():
        for name in vars(part):
            setattr(part, name, arrays[prefix + name])
    run.report = FitReport(**rest["report"])
    run.rng.bit_generator.state = rest["rng"]
    run.turn, run.step = rest["turn"], rest["step"]
