"""A step of a fit: forward, loss, backward and Adam on one photo; here with arrays in memory.

For the backends `cpu` and `torch`; `device_descent` has a subclass for a GPU.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import raster
from dav_gswt.field import SH0
from dav_gswt.images import channels
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import Gradients
from dav_gswt.reconstruction.fitting import densification, exposure
from dav_gswt.reconstruction.fitting.plan import FitPlan, Schedule
from dav_gswt.reconstruction.fitting.state import State
from dav_gswt.reconstruction.ground import smooth
from dav_gswt.reconstruction.ground_constraints import GroundConstraints

STRUCTURE = 0.2  # weight of D-SSIM against L1
RATES = {"log_scales": 6e-2, "quats": 1.2e-2, "opacity_logits": 0.1}  # a step, at the start
COLOUR = 6e-3 / SH0  # rate of the constant harmonic: steps of 0.006 in colour
DIRECTED = 0.1  # of that: rate of the view-dependent harmonics
DRIFT = 0.3  # `constraints.detail` a step, at the start
BETAS = 0.8, 0.98  # of Adam: short memories, since a Gaussian is in few photos
BACKDROP = 0.5  # strength of the random background's pull to opacity
ERROR_PHOTOS = 12  # whose errors say where to grow
Parts = tuple[str, ...]
PARTS = "values", "first", "second"  # of `State`


@dataclass
class TrainingState:
    """All that changes from step to step.

    errors: squared errors of the last photos, projected back onto the Gaussians by blend weights; None before the first
    photo that counts. turn: the photos of this epoch that are yet to come.
    """

    state: State
    rng: np.random.Generator
    exposures: exposure.ExposureTracker
    errors: Float32[Array, "n"] | None = None
    turn: list[int] = field(default_factory=list)
    step: int = 0

    def add_errors(self, found: Float32[Array, "n"]) -> None:
        """Add the errors that a photo projects back."""
        self.errors = found if self.errors is None else self.errors + found


@dataclass(frozen=True)
class TrainingTask:
    """All that stays the same."""

    views: list[TrainingView]
    plan: FitPlan
    schedule: Schedule
    constraints: GroundConstraints
    raster: raster.Rasterizer

    def collects_errors(self, step: int) -> bool:
        """Whether the error after this step says where to grow."""
        ahead = self.schedule.to_growth(step + 1)
        return ahead is not None and ahead < min(ERROR_PHOTOS, len(self.views))

    def rates(self, step: int, harmonics: int) -> dict[str, float | Float32[Array, "columns"]]:
        """Adam's rate of each parameter; of colours one a column."""
        falling = self.schedule.rate(step)
        directed = np.repeat([1.0] + [DIRECTED] * (harmonics - 1), 3).astype(np.float32)
        rates: dict = {name: rate * falling**0.5 for name, rate in RATES.items()}
        rates["means"] = DRIFT * self.constraints.detail * falling
        rates["colours"] = COLOUR * falling**0.5 * (directed if harmonics > 1 else 1.0)
        return rates


class Descent:
    """How steps are done: here with parameters in `run.state`. Where a subclass has them elsewhere, it copies them."""

    def descend(self, run: TrainingState, task: TrainingTask, index: int) -> None:
        """One step on a photo: gradients, exposure, errors that say where to grow, Adam."""
        view = task.views[index]
        seen = task.raster.forward(**run.state.values, camera=view.camera)
        behind = background(view, run.rng.uniform(0, 1, 3).astype(np.float32))
        image = channels.composite(seen.colour, seen.alpha, behind)
        sample = exposure.sample_photo(view.image, view.weight)
        run.exposures.learn(index, exposure.thin(image, view.weight.size), sample)
        gain, offset = run.exposures.gain_and_offset(index)
        exposed = channels.scale_channels(image, gain, offset)
        if task.collects_errors(run.step):
            apart = exposed - view.image
            squared = channels.sum_products(apart, apart) / 3 * view.weight
            run.add_errors(task.raster.contributions(squared[..., None]).mapped[:, 0])
        _, gradient = raster.loss(exposed, view.image, view.weight, STRUCTURE)
        gradient = channels.scale_channels(gradient, gain)
        gradients = task.raster.backward(gradient, -BACKDROP * channels.sum_products(gradient, behind))
        hold_ground(vars(gradients), task.constraints)
        self._step_adam(run, task, gradients)
        view.release()

    def perturb(self, run: TrainingState, task: TrainingTask) -> None:
        """See `densification.perturb`, after the step `run.step`."""
        densification.perturb(run.state.values, task.constraints.fixed, perturbation(run, task), run.rng)

    def pull(self, run: TrainingState, parts: Parts = PARTS) -> None:
        """Bring these parts of `run.state` up to date."""

    def push(self, run: TrainingState, parts: Parts = PARTS) -> None:
        """Go on from these parts of `run.state`, which were changed."""

    @contextmanager
    def on_host(self, run: TrainingState, parts: Parts = PARTS) -> Iterator[None]:
        """Change these parts of `run.state` in the block."""
        self.pull(run, parts)
        yield
        self.push(run, parts)

    def _step_adam(self, run: TrainingState, task: TrainingTask, gradients: Gradients) -> None:
        """One step of Adam for the visible Gaussians; the others keep their values and moments."""
        rates = task.rates(run.step, run.state.values["colours"].shape[1])
        visible = task.raster.visible
        for name, value in run.state.values.items():
            moments = run.state.first[name], run.state.second[name]
            rate, gradient = rates[name], getattr(gradients, name)
            raster.adam(value, gradient, *moments, rate=rate, step=run.step + 1, betas=BETAS, rows=visible)


def background(view: TrainingView, colour: Float32[Array, "3"]) -> Float32[Array, "*hw 3"]:
    """A colour, and in each pixel the sky where the photo shows it."""
    return colour if view.behind is None else channels.fill_unknown(view.behind, colour)


def hold_ground(gradients: dict[str, Any], constraints: GroundConstraints, blur: Callable = smooth) -> None:
    """Change gradients (arrays or tensors) in place, as the ground's constraints say.

    Discs turn with the surface (see `project_parameters`), their heights move together, and the underlay follows them.
    """
    n, held = constraints.discs, slice(constraints.discs, constraints.fixed)
    up = gradients["means"][:n, 2].reshape(constraints.shape)
    gradients["means"][:n, 2] = 0 if constraints.smoothing is None else blur(up, constraints.smoothing).reshape(-1)
    gradients["quats"][:n] = 0
    for part in gradients.values():
        if part is not None:
            part[held] = 0


def perturbation(run: TrainingState, task: TrainingTask) -> float:
    """Strength of the perturbation after the step `run.step`."""
    return densification.PERTURBATION * task.schedule.rate(run.step)
