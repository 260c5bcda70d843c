"""The fit: gradient descent on what the photos see.

One photo a step, L1 + D-SSIM, Adam, a random colour behind the picture (so that dark grains are not modelled by
transparency) or the sky where the photo shows it. Photos change exposure: each step fits its picture's gain and offset
first. The rules of the scene (`rules.Rules`) have the last word on gradients and parameters.
"""

import logging
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.field import SH0, GaussianField
from dav_gswt.images import image_files
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView, make_training_view
from dav_gswt.reconstruction.fitting import densification, exposure, held_out, sh_degree, snapshot, state
from dav_gswt.reconstruction.fitting import pose_refinement as poses
from dav_gswt.reconstruction.fitting.constraints import Rules
from dav_gswt.reconstruction.fitting.plan import AUTO, Plan, Report
from dav_gswt.reconstruction.fitting.residual import Residual
from dav_gswt.reconstruction.fitting.schedule import VISIBLE, Schedule
from dav_gswt.reconstruction.fitting.state import State

_log = logging.getLogger(__name__)

STRUCTURE = 0.2  # weight of D-SSIM against L1
RATES = {"log_scales": 2e-2, "quats": 4e-3, "opacity_logits": 0.1}  # a step, at the start
COLOUR = 6e-3 / SH0  # of the constant harmonic: steps of 0.006 in colour
DIRECTED = 0.1  # of that: the rate of the harmonics that depend on direction
DRIFT = 0.3  # `rules.reach` a step, at the start
BETAS = 0.8, 0.98  # of Adam: short memories, since a Gaussian is in few photos
KEEP = 10  # steps between two looks at the rules
BACKDROP = 0.5  # strength of the random background's pull to opacity
LOOKS = 12  # photos whose errors say where to grow
LEAST_OPACITY = 0.02  # of a free Gaussian that stays when the fit ends
LEAST_PEAK = 0.03  # its largest blend weight in any photo, not to be pruned


@dataclass(frozen=True)
class Fitted:
    """A field and how it came to be."""

    field: GaussianField
    report: Report


@dataclass
class Run:
    """All that changes from step to step: what a snapshot holds."""

    state: State
    report: Report
    rng: np.random.Generator
    levels: exposure.Levels
    poses: poses.Poses
    residual: Residual
    turn: list[int]
    step: int = 0


@dataclass(frozen=True)
class Task:
    """All that does not change."""

    views: list[TrainingView]
    halves: list[TrainingView]
    held: list[Array] | None
    plan: Plan
    schedule: Schedule
    rules: Rules
    raster: "raster.Rasterizer"


def fit(
    field: GaussianField,
    views: list[TrainingView],
    plan: Plan,
    rules: Rules,
    rng: np.random.Generator,
    what: str = "fit",
    keep: Path | str | None = None,
    watch: Callable[[int, State], None] | None = None,
) -> Fitted:
    """Fit a field to views.

    A view's weight decides which of its pixels count. keep: folder for snapshots; a fit that was killed and is called
    again with the same arguments goes on from there. watch: called after every step, to measure.
    Returns: the field, its first `rules.fixed` Gaussians in their order, and the report.
    Raises: ValueError: no view.
    """
    if not views:
        raise ValueError("a fit needs at least one view")
    keeper = snapshot.Keeper(keep, _key(field, views, plan, rng) if keep else "")
    run = _begun(field, views, plan, rng)
    task = _task(len(field), views, plan, rules, np.random.default_rng(len(views)))
    if kept := keeper.load():
        _resume(run, *kept)
        _log.info("%s: goes on from step %d", what, run.step)
    for _ in progress(range(run.step, plan.steps), what):
        _advance(run, task)
        if watch:
            watch(run.step, run.state)
        if keeper.due():
            keeper.save(*_kept(run))
    keeper.clear()
    return _ended(run, task, what)


def _begun(field: GaussianField, views: list[TrainingView], plan: Plan, rng: np.random.Generator) -> Run:
    begun = state.of(field)
    if begun.sh_degree > plan.most_degree:
        begun.bend_to(plan.most_degree)
    n = len(views)
    return Run(begun, Report(), rng, exposure.Levels(n), poses.Poses(n), Residual(), [])


def _task(start: int, views: list[TrainingView], plan: Plan, rules: Rules, rng: np.random.Generator) -> Task:
    held = [held_out.mask(*v.image.shape[:2], rng) for v in views] if plan.degree == AUTO else None
    halves = [_half(v) for v in views] if plan.half_share else []
    return Task(views, halves, held, plan, Schedule(plan, start), rules, raster.Rasterizer())


def _half(view: TrainingView) -> TrainingView:
    """A view at half its size."""
    half = make_training_view(view.name, view.camera, view.image, max(view.camera.width, view.camera.height) // 2)
    width, height = half.camera.width, half.camera.height
    weight = image_files.shrink_image(view.weight[..., None], width, height)[..., 0]
    rows, columns = ((np.arange(n) + 0.5) * of // n for n, of in zip((height, width), view.weight.shape, strict=True))
    behind = None if view.behind is None else view.behind[rows.astype(int)][:, columns.astype(int)]
    return replace(half, weight=np.ascontiguousarray(weight, np.float32), behind=behind)


def _advance(run: Run, task: Task) -> None:
    """One step, and what is due after it."""
    if not run.turn:
        run.turn = list(map(int, run.rng.permutation(len(task.views))))
    _warm_up(run, task)
    _descend(run, task, run.turn.pop())
    run.step += 1
    if run.step % KEEP == 0 or run.step == task.plan.steps:
        task.rules.keep(run.state.values)
    densification.shake(run.state, task.rules.fixed, densification.SHAKE * task.schedule.rate(run.step), run.rng)
    if task.schedule.to_growth(run.step) == 0:
        _grow(run, task)
    if task.schedule.prunes(run.step):
        _prune(run, task)


def _warm_up(run: Run, task: Task) -> None:
    """The spherical harmonics come one degree after the other, in the first half."""
    due = int(task.plan.most_degree * min(1.0, 2 * run.step / max(1, task.plan.steps)))
    if due > run.state.sh_degree:
        run.state.bend_to(due)


def _descend(run: Run, task: Task, index: int) -> None:
    """Forward, loss, backward and one step of Adam on one photo."""
    early = run.step < task.plan.half_share * task.plan.steps
    view = (task.halves if early else task.views)[index]
    weight = view.weight
    if task.held is not None and not early:
        weight = np.where(task.held[index], np.float32(0), weight)
        view = replace(view, weight=weight)
    camera = run.poses.moved(index, view.camera)
    seen = task.raster.forward(**run.state.values, camera=camera)
    behind = _behind(view, run.rng.uniform(0, 1, 3).astype(np.float32))
    shown, gain = _exposed(run, index, seen, behind, view)
    ahead = task.schedule.to_growth(run.step + 1)  # steps after this one
    if ahead is not None and ahead < min(LOOKS, len(task.views)):
        run.residual.note(task.raster, shown - view.image, weight)
    _, gradient = raster.loss(shown, view.image, weight, STRUCTURE)
    gradient = np.ascontiguousarray(gradient * gain)
    gradients = task.raster.backward(gradient, -BACKDROP * np.einsum("hwc,hwc->hw", gradient, behind))
    task.rules.guide(gradients)
    _adam(run, task, gradients)
    if task.plan.pose_rate:
        run.poses.descend(index, gradients.camera, task.plan.pose_rate * task.schedule.rate(run.step), camera)


def _behind(view: TrainingView, colour: Float32[Array, "3"]) -> Float32[Array, "h w 3"]:
    """A colour, and the sky where the photo shows it."""
    if view.behind is None:
        return np.broadcast_to(colour, view.image.shape)
    return np.where(np.isnan(view.behind), colour, view.behind)


def _over(seen, behind: Float32[Array, "h w 3"]) -> Float32[Array, "h w 3"]:
    return seen.colour + (1 - seen.alpha)[..., None] * behind


def _exposed(run: Run, index: int, seen, behind: Float32[Array, "h w 3"], view: TrainingView):
    """The picture over its background, brought to the photo's exposure, and the gain."""
    image = _over(seen, behind)
    run.levels.look(index, image, view)
    a, b = run.levels.of(index)
    return np.ascontiguousarray(image * a + b), a


def _adam(run: Run, task: Task, gradients) -> None:
    """One step of Adam on what the photo sees; all else keeps its value and its moments."""
    falling = task.schedule.rate(run.step)
    k = run.state.values["colours"].shape[1]
    directed = np.repeat([1.0] + [DIRECTED] * (k - 1), 3).astype(np.float32)
    rates = {name: rate * falling**0.5 for name, rate in RATES.items()}
    rates["means"] = DRIFT * task.rules.reach * falling
    rates["colours"] = COLOUR * falling**0.5 * (directed if k > 1 else 1.0)
    drawn = task.raster.visible
    for name, value in run.state.values.items():
        moments = run.state.first[name], run.state.second[name]
        raster.adam(
            value, getattr(gradients, name), *moments, rate=rates[name], step=run.step + 1, betas=BETAS, rows=drawn
        )


def _grow(run: Run, task: Task) -> None:
    """Growth is due: to where the errors of the photos before it are."""
    lost, cap = task.rules.lost(run.state.values), task.schedule.cap(run.step, len(run.state), run.residual.of_a_photo)
    densification.grow(run.state, task.rules.fixed, lost, run.residual.errors, cap, run.rng)
    run.residual = Residual()


def _prune(run: Run, task: Task) -> None:
    """Free Gaussians that hardly show in any photo go, while there are steps left to make up for them.

    They are a haze, which every photo has explained in its own way (desert, meadow, for development: without 31 and
    21 % of all Gaussians new views gain .27 and .00 dB, and their LPIPS falls by .003 and .002).
    """
    peak = np.zeros(len(run.state), np.float32)
    for index, view in enumerate(task.views):
        task.raster.forward(**run.state.values, camera=run.poses.moved(index, view.camera))
        peak = np.maximum(peak, task.raster.contributions().maximum)
    peak[: task.rules.fixed] = 1
    run.state.take(np.flatnonzero(peak > LEAST_PEAK))
    run.residual = Residual()


def _score(run: Run, task: Task, now: State) -> float:
    """PSNR of the held-out pixels of all photos."""
    tally = held_out.Tally()
    for index, view in enumerate(task.views):
        seen = task.raster.forward(**now.values, camera=run.poses.moved(index, view.camera))
        a, b = run.levels.of(index)
        shown = _over(seen, _behind(view, np.full(3, 0.5, np.float32))) * a + b
        tally.note(shown, view.image, view.weight * task.held[index])
    return tally.psnr


def _ended(run: Run, task: Task, what: str) -> Fitted:
    if task.held is not None:
        cameras = [view.camera for view in task.views]
        run.state = sh_degree.least(run.state, cameras, lambda now: _score(run, task, now), run.report)
    values = run.state.values
    alive = densification.opacities(values["opacity_logits"]) > LEAST_OPACITY
    alive &= ~task.rules.lost(values)
    alive[: task.rules.fixed] = True
    field = state.field_of(run.state, task.rules.discs, alive)
    if task.plan.cap == AUTO:
        run.report.chose("cap", len(field), f"as many as {VISIBLE:g} of error in a pixel ask for")
    run.report.steps, run.report.gaussians, run.report.degree = run.step, len(field), run.state.sh_degree
    for choice in run.report.choices:
        _log.info("%s: %s is %s: %s", what, choice["what"], choice["value"], choice["why"])
    return Fitted(field, run.report)


def _key(field: GaussianField, views: list[TrainingView], plan: Plan, rng: np.random.Generator) -> str:
    arrays = [a for v in views for a in (v.image, v.weight, v.behind, v.camera.rotation, v.camera.translation)]
    numbers = [(v.camera.fx, v.camera.fy, v.camera.cx, v.camera.cy) for v in views]
    return snapshot.key(*vars(field).values(), *arrays, numbers, plan, rng.bit_generator.state)


def _kept(run: Run) -> tuple[dict[str, Array], dict]:
    arrays = {f"{part}.{name}": a for part, of in vars(run.state).items() for name, a in of.items()}
    for prefix, part in _parts(run).items():
        arrays |= {prefix + name: a for name, a in vars(part).items()}
    rest = {"report": asdict(run.report), "rng": run.rng.bit_generator.state}
    return arrays, rest | {"turn": run.turn, "step": run.step}


def _parts(run: Run) -> dict:
    """What is kept as it is, by the prefix of its names in a snapshot."""
    return {"level.": run.levels, "pose.": run.poses, "residual.": run.residual}


def _resume(run: Run, arrays: dict[str, Array], rest: dict) -> None:
    run.state = State(**{part: {k: arrays[f"{part}.{k}"] for k in state.NAMES} for part in vars(run.state)})
    for prefix, part in _parts(run).items():
        for name in vars(part):
            setattr(part, name, arrays[prefix + name])
    run.report = Report(**rest["report"])
    run.rng.bit_generator.state = rest["rng"]
    run.turn, run.step = rest["turn"], rest["step"]
