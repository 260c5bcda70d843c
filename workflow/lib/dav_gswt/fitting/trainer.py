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

from dav_gswt import images, raster
from dav_gswt import views as photos
from dav_gswt.field import SH0, Field
from dav_gswt.fitting import exposure, growth, held_out, poses, snapshot, state
from dav_gswt.fitting.plan import Plan, Report
from dav_gswt.fitting.rules import Rules
from dav_gswt.fitting.search import Search
from dav_gswt.fitting.state import State
from dav_gswt.logs import progress
from dav_gswt.views import View

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


@dataclass(frozen=True)
class Fitted:
    """A field and how it came to be."""

    field: Field
    report: Report


@dataclass
class Run:
    """All that changes from step to step: what a snapshot holds."""

    state: State
    search: Search
    report: Report
    rng: np.random.Generator
    levels: exposure.Levels
    poses: poses.Poses
    turn: list[int]
    step: int = 0
    before_trial: State | None = None


@dataclass(frozen=True)
class Task:
    """All that does not change."""

    views: list[View]
    halves: list[View]
    held: list[Array] | None
    tally: held_out.Tally
    plan: Plan
    rules: Rules
    raster: "raster.Rasterizer"


def fit(
    field: Field,
    views: list[View],
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
    task = _task(views, plan, rules, np.random.default_rng(len(views)))
    if kept := keeper.load():
        _resume(run, task, *kept)
        _log.info("%s: goes on from step %d", what, run.step)
    total = run.search.end
    for _ in progress(iter(lambda: run.search.done(run.step), True), what, total=total and total - run.step):
        _advance(run, task)
        if watch:
            watch(run.step, run.state)
        if keeper.due():
            keeper.save(*_kept(run, task))
    keeper.clear()
    return _ended(run, task, what)


def _begun(field: Field, views: list[View], plan: Plan, rng: np.random.Generator) -> Run:
    begun = state.of(field)
    if plan.degree != "auto" and begun.degree > plan.degree:
        begun.bend_to(plan.degree)
    search = Search.of(plan, len(views), len(field))
    return Run(begun, search, Report(), rng, exposure.Levels(len(views)), poses.Poses(len(views)), [])


def _task(views: list[View], plan: Plan, rules: Rules, rng: np.random.Generator) -> Task:
    held = [held_out.mask(*v.image.shape[:2], rng) for v in views] if plan.searching else None
    halves = [_half(v) for v in views] if plan.half_share else []
    return Task(views, halves, held, held_out.Tally(len(views)), plan, rules, raster.Rasterizer())


def _half(view: View) -> View:
    """A view at half its size."""
    half = photos.of(view.name, view.camera, view.image, max(view.camera.width, view.camera.height) // 2)
    width, height = half.camera.width, half.camera.height
    weight = images.resized(view.weight[..., None], width, height)[..., 0]
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
    if run.step % KEEP == 0 or run.search.done(run.step):
        task.rules.keep(run.state.values)
    growth.shake(run.state, task.rules.fixed, growth.SHAKE * run.search.rate(run.step), run.rng)
    if task.held is not None and run.step % run.search.window == 0:
        _look(run, task)
    if (cap := run.search.cap(run.step, len(run.state))) is not None:
        lost = task.rules.lost(run.state.values)
        growth.grow(run.state, task.rules.fixed, lost, _errors(run, task), cap, run.rng)


def _warm_up(run: Run, task: Task) -> None:
    """The spherical harmonics of a plan with a number come one degree after the other, in the first half."""
    if task.plan.degree == "auto" or run.state.degree == task.plan.degree or run.search.end is None:
        return
    due = int(task.plan.degree * min(1.0, 2 * run.step / run.search.end))
    if due > run.state.degree:
        run.state.bend_to(due)


def _descend(run: Run, task: Task, index: int) -> None:
    """Forward, loss, backward and one step of Adam on one photo."""
    early = run.search.end is not None and run.step < task.plan.half_share * run.search.end
    view = (task.halves if early else task.views)[index]
    weight = view.weight
    if task.held is not None and not early:
        weight = np.where(task.held[index], np.float32(0), weight)
        view = replace(view, weight=weight)
    camera = run.poses.moved(index, view.camera)
    seen = task.raster.forward(**run.state.values, camera=camera)
    behind = _behind(view, run.rng)
    shown, gain = _exposed(run, index, seen, behind, view)
    if task.held is not None and not early:
        task.tally.note(index, shown, view.image, task.views[index].weight * task.held[index])
    _, gradient = raster.loss(shown, view.image, weight, STRUCTURE)
    gradient = np.ascontiguousarray(gradient * gain)
    gradients = task.raster.backward(gradient, -BACKDROP * np.einsum("hwc,hwc->hw", gradient, behind))
    task.rules.guide(gradients)
    _adam(run, task, gradients)
    if task.plan.pose_rate:
        run.poses.descend(index, gradients.camera, task.plan.pose_rate * run.search.rate(run.step), camera)


def _behind(view: View, rng: np.random.Generator) -> Float32[Array, "h w 3"]:
    """A colour drawn for this step, and the sky where the photo shows it."""
    drawn = rng.uniform(0, 1, 3).astype(np.float32)
    if view.behind is None:
        return np.broadcast_to(drawn, view.image.shape)
    return np.where(np.isnan(view.behind), drawn, view.behind)


def _over(seen, behind: Float32[Array, "h w 3"]) -> Float32[Array, "h w 3"]:
    return seen.colour + (1 - seen.alpha)[..., None] * behind


def _exposed(run: Run, index: int, seen, behind: Float32[Array, "h w 3"], view: View):
    """The picture over its background, brought to the photo's exposure, and the gain."""
    image = _over(seen, behind)
    run.levels.look(index, image, view)
    a, b = run.levels.of(index)
    return np.ascontiguousarray(image * a + b), a


def _adam(run: Run, task: Task, gradients) -> None:
    """One step of Adam on what the photo sees; all else keeps its value and its moments."""
    falling = run.search.rate(run.step)
    k = run.state.values["colours"].shape[1]
    directed = np.repeat([1.0] + [DIRECTED] * (k - 1), 3).astype(np.float32)
    rates = {name: rate * falling**0.5 for name, rate in RATES.items()}
    rates["means"] = DRIFT * task.rules.reach * falling
    rates["colours"] = COLOUR * falling**0.5 * (directed if k > 1 else 1.0)
    drawn = task.raster.drawn
    for name, value in run.state.values.items():
        moments = run.state.first[name], run.state.second[name]
        raster.adam(
            value, getattr(gradients, name), *moments, rate=rates[name], step=run.step + 1, betas=BETAS, rows=drawn
        )


def _errors(run: Run, task: Task) -> Float32[Array, "n"]:
    """Squared error of some photos, carried back onto the Gaussians by their blend weights."""
    total = np.zeros(len(run.state), np.float32)
    count = min(LOOKS, len(task.views))
    for index in map(int, run.rng.choice(len(task.views), count, replace=False)):
        view = task.views[index]
        seen = task.raster.forward(**run.state.values, camera=run.poses.moved(index, view.camera))
        a, b = run.levels.of(index)
        apart = ((_over(seen, _behind(view, run.rng)) * a + b - view.image) ** 2).mean(-1) * view.weight
        total += task.raster.contributions(np.ascontiguousarray(apart[..., None], np.float32)).mapped[:, 0]
    return total


def _look(run: Run, task: Task) -> None:
    """Let the held-out pixels decide."""
    search, now = run.search, run.state
    told = search.look(run.step, task.tally.psnr, len(now), now.degree, run.report)
    if told == "enrich":
        run.before_trial = now.copy()
        now.bend_to(now.degree + 1)
    elif told == "take back":
        run.state = run.before_trial
        search.last = None
    if told != "enrich":
        run.before_trial = None


def _ended(run: Run, task: Task, what: str) -> Fitted:
    values = run.state.values
    alive = growth.opacities(values["opacity_logits"]) > LEAST_OPACITY
    alive &= ~task.rules.lost(values)
    alive[: task.rules.fixed] = True
    field = state.field_of(run.state, task.rules.discs, alive)
    run.report.steps, run.report.gaussians, run.report.degree = run.step, len(field), run.state.degree
    for choice in run.report.choices:
        _log.info("%s: %s is %s: %s", what, choice["what"], choice["value"], choice["why"])
    return Fitted(field, run.report)


def _key(field: Field, views: list[View], plan: Plan, rng: np.random.Generator) -> str:
    arrays = [a for v in views for a in (v.image, v.weight, v.behind, v.camera.rotation, v.camera.translation)]
    numbers = [(v.camera.fx, v.camera.fy, v.camera.cx, v.camera.cy) for v in views]
    return snapshot.key(*vars(field).values(), *arrays, numbers, plan, rng.bit_generator.state)


def _kept(run: Run, task: Task) -> tuple[dict[str, Array], dict]:
    arrays = {f"{part}.{name}": a for part, of in vars(run.state).items() for name, a in of.items()}
    if run.before_trial is not None:
        arrays |= {f"trial.{part}.{k}": a for part, of in vars(run.before_trial).items() for k, a in of.items()}
    for prefix, part in _parts(run, task).items():
        arrays |= {prefix + name: a for name, a in vars(part).items()}
    search = {k: v for k, v in vars(run.search).items() if k != "plan"}
    rest = {"search": search, "report": asdict(run.report), "rng": run.rng.bit_generator.state}
    return arrays, rest | {"turn": run.turn, "step": run.step}


def _parts(run: Run, task: Task) -> dict:
    """What is kept as it is, by the prefix of its names in a snapshot."""
    return {"level.": run.levels, "pose.": run.poses, "tally.": task.tally}


def _resume(run: Run, task: Task, arrays: dict[str, Array], rest: dict) -> None:
    def state_of(prefix: str) -> State:
        parts = {part: {k: arrays[f"{prefix}{part}.{k}"] for k in state.NAMES} for part in vars(run.state)}
        return State(**parts)

    run.state = state_of("")
    run.before_trial = state_of("trial.") if "trial.values.means" in arrays else None
    for prefix, part in _parts(run, task).items():
        for name in vars(part):
            setattr(part, name, arrays[prefix + name])
    run.search = replace(run.search, **rest["search"])
    run.report = Report(**rest["report"])
    run.rng.bit_generator.state = rest["rng"]
    run.turn, run.step = rest["turn"], rest["step"]
