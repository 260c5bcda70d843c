"""A step of a fit: forward, exposure, loss, backward and Adam on one photo; here on arrays.

For the backends `cpu` and `torch`; `device_descent` has a subclass for a GPU.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt import arrays, raster
from dav_gswt.field import SH0
from dav_gswt.images import channels
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction.fitting import densification, exposure
from dav_gswt.reconstruction.fitting.plan import FitPlan, Schedule
from dav_gswt.reconstruction.fitting.state import State
from dav_gswt.reconstruction.ground_constraints import GroundConstraints

STRUCTURE = 0.2  # weight of D-SSIM against L1
RATES = {"log_scales": 6e-2, "quats": 1.2e-2, "opacity_logits": 0.1}  # a step, at the start
COLOUR = 6e-3 / SH0  # rate of the constant harmonic: steps of 0.006 in colour
DIRECTED = 0.1  # of that: rate of the view-dependent harmonics
DRIFT = 0.3  # `constraints.detail` a step, at the start
BETAS = 0.8, 0.98  # of Adam: short memories, since a Gaussian is in few photos
BACKDROP = 0.5  # strength of the random background's pull to opacity
ERROR_PHOTOS = 12  # whose errors say where to grow


@dataclass
class TrainingState:
    """All that changes from step to step.

    errors: squared errors of the last photos, projected back onto the Gaussians by blend weights; None before the first
    photo that counts. turn: the photos of this epoch that are yet to come. loss: of the last step.
    """

    state: State
    rng: np.random.Generator
    exposures: exposure.ExposureTracker
    errors: Any = None
    turn: list[int] = field(default_factory=list)
    step: int = 0
    loss: Any = None

    def add_errors(self, found: Float32[Any, "n"]) -> None:
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

    def rates(self, step: int, colours: Float32[Any, "n k 3"]) -> dict[str, Any]:
        """Adam's rate of each parameter; of colours with harmonics one a column."""
        falling = self.schedule.rate(step)
        rates: dict = {name: rate * falling**0.5 for name, rate in RATES.items()}
        rates["means"] = DRIFT * self.constraints.detail * falling
        rates["colours"] = COLOUR * falling**0.5
        if colours.shape[1] > 1:
            share = arrays.zeros((colours.shape[1], 3), colours) + DIRECTED
            arrays.fill(share[0], 1)
            rates["colours"] = share.reshape(-1) * rates["colours"]
        return rates


class Descent:
    """How steps are done: here on arrays, by the interface of rasterizers.

    What a step computes is said once, in `descend`; a subclass says where, with arrays or tensors.
    """

    def start(self, run: TrainingState, task: TrainingTask) -> None:
        """Bring what steps need to where they are done."""

    def descend(self, run: TrainingState, task: TrainingTask, index: int) -> None:
        """One step on a photo: gradients, exposure, errors that say where to grow, Adam."""
        photo = self._find_photo(task, index)
        colour, alpha = self._draw(run, task, photo.camera)
        behind = background(photo, self._bring(run.rng.uniform(0, 1, 3).astype(np.float32)))
        image = channels.composite(colour, alpha, behind)
        run.exposures.learn(index, *map(exposure.thin, (image, photo.image, photo.weight)))
        gain, offset = run.exposures.gain_and_offset(index)
        exposed = channels.scale_channels(image, gain, offset)
        if task.collects_errors(run.step):
            apart = exposed - photo.image
            run.add_errors(self._project_back(task, channels.sum_products(apart, apart) / 3 * photo.weight))
        run.loss, gradient = self._differentiate_loss(exposed, photo)
        gradient = channels.scale_channels(gradient, gain)
        gradients = self._differentiate(task, gradient, -BACKDROP * channels.sum_products(gradient, behind))
        hold_ground(gradients, task.constraints)
        self._step_adam(run, task, gradients)
        task.views[index].release()

    def perturb(self, run: TrainingState, task: TrainingTask) -> None:
        """See `densification.perturb`, after the step `run.step`."""
        densification.perturb(run.state.values, task.constraints.fixed, perturbation(run, task), run.rng)

    def check(self, run: TrainingState) -> None:
        """Raises: ValueError: values are no longer finite; here each forward pass has checked them."""

    def measure_peaks(self, run: TrainingState, task: TrainingTask) -> Float32[Array, "n"]:
        """Largest blend weight of each Gaussian in any photo."""
        peak = np.zeros(len(run.state), np.float32)
        for _ in task.raster.forward_each(run.state.values, (view.camera for view in task.views)):
            peak = np.maximum(peak, task.raster.contributions().maximum)
        return peak

    def _find_photo(self, task: TrainingTask, index: int) -> Any:
        """A photo's image, weight, camera and what is behind."""
        return task.views[index]

    def _bring(self, numbers: Float32[Array, "c"]) -> Any:
        """A few numbers."""
        return numbers

    def _draw(self, run: TrainingState, task: TrainingTask, camera: Any) -> tuple[Any, Any]:
        """Colour and alpha of the field's picture."""
        seen = task.raster.forward(**run.state.values, camera=camera)
        return seen.colour, seen.alpha

    def _project_back(self, task: TrainingTask, errors: Any) -> Any:
        """Errors of pixels, summed over each Gaussian by the blend weights of the last picture."""
        return task.raster.contributions(errors[..., None]).mapped[:, 0]

    def _differentiate_loss(self, image: Any, photo: Any) -> tuple[Any, Any]:
        """Loss of a picture and its gradient."""
        return raster.loss(image, photo.image, photo.weight, STRUCTURE)

    def _differentiate(self, task: TrainingTask, by_colour: Any, by_alpha: Any) -> dict[str, Any]:
        """Gradients by the parameters of the last picture."""
        return vars(task.raster.backward(by_colour, by_alpha))

    def _step_adam(self, run: TrainingState, task: TrainingTask, gradients: dict[str, Any]) -> None:
        """One step of Adam for the visible Gaussians; the others keep their values and moments."""
        rates, visible = task.rates(run.step, run.state.values["colours"]), task.raster.visible
        for name, value in run.state.values.items():
            four = value, gradients[name], run.state.first[name], run.state.second[name]
            raster.adam(*four, rate=rates[name], step=run.step + 1, betas=BETAS, rows=visible)


def background(photo: Any, colour: Float32[Any, "3"]) -> Float32[Any, "*hw 3"]:
    """A colour, and in each pixel the sky where the photo shows it."""
    return colour if photo.behind is None else channels.fill_unknown(photo.behind, colour)


def hold_ground(gradients: dict[str, Any], constraints: GroundConstraints) -> None:
    """Change gradients (arrays or tensors) in place, as the ground's constraints say.

    Discs turn with the surface (see `project_parameters`), their heights move together, and the underlay follows them.
    """
    n, held, up = constraints.discs, slice(constraints.discs, constraints.fixed), gradients["means"]
    if constraints.smoothing is None:
        arrays.fill(up[:n, 2], 0)
    else:
        up[:n, 2] = arrays.blur(up[:n, 2].reshape(constraints.shape), constraints.smoothing).reshape(-1)
    arrays.fill(gradients["quats"][:n], 0)
    for part in gradients.values():
        arrays.fill(part[held], 0)


def perturbation(run: TrainingState, task: TrainingTask) -> float:
    """Strength of the perturbation after the step `run.step`."""
    return densification.PERTURBATION * task.schedule.rate(run.step)
