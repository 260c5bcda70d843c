"""The steps of a fit on a GPU, where parameters, Adam's moments and photos stay: the backend `cuda`.

Only what rarely happens (growth, projection, pruning) and what is small (heights of the ground, pixels that tell the
exposure) is done by the same functions as without a GPU, on copies. Two runs differ in the last bits: see raster/cuda.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float32
from kornia.filters import gaussian_blur2d
from torch import Tensor

from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import cuda
from dav_gswt.raster.torch import differentiate_loss
from dav_gswt.reconstruction.fitting import densification, exposure
from dav_gswt.reconstruction.fitting.descent import (
    BACKDROP,
    BETAS,
    PARTS,
    STRUCTURE,
    Descent,
    Parts,
    TrainingState,
    TrainingTask,
    hold_ground,
    perturbation,
)

EPSILON = 1e-15  # of Adam, as in `interface.Adam`
CACHE = 150e6  # pixels of photos kept on the device, of 28 bytes at most; others are copied at every step
USED_BY_PERTURB = "means", "log_scales", "quats", "opacity_logits"


@dataclass(frozen=True)
class Photo:
    """A view's arrays on the device, and the pixels of it that tell the exposure."""

    image: Float32[Tensor, "h w 3"]
    weight: Float32[Tensor, "h w"]
    behind: Float32[Tensor, "h w 3"] | None
    sample: exposure.Sample


class DeviceDescent(Descent):
    """Between `push` and `pull` the parameters are on the device."""

    def __init__(self, rasterizer: cuda.Rasterizer):
        self.raster, self.device = rasterizer, rasterizer.device
        self.values: dict[str, Tensor] = {}
        self.first: dict[str, Tensor] = {}
        self.second: dict[str, Tensor] = {}
        self._photos: dict[int, Photo] = {}

    def pull(self, run: TrainingState, parts: Parts = PARTS) -> None:
        """See `Descent.pull`."""
        for part in parts:
            getattr(run.state, part).update({k: cuda.download(t) for k, t in getattr(self, part).items()})

    def push(self, run: TrainingState, parts: Parts = PARTS) -> None:
        """See `Descent.push`."""
        for part in parts:
            tensors = {k: cuda.upload(a, self.device).clone() for k, a in getattr(run.state, part).items()}
            setattr(self, part, tensors)

    def descend(self, run: TrainingState, task: TrainingTask, index: int) -> None:
        """See `Descent.descend`."""
        view, photo = task.views[index], self._find_photo(task.views[index], index)
        last = self.raster.draw(self.values, view.camera)
        picture, alpha = last.picture.detach()[0, ..., :3], last.alpha.detach()[0]
        colour = torch.tensor(run.rng.uniform(0, 1, 3).astype(np.float32), device=self.device)
        behind = colour if photo.behind is None else torch.where(photo.behind.isnan(), colour, photo.behind)
        image = picture + (1 - alpha) * behind
        run.exposures.learn(index, cuda.download(exposure.thin(image, view.weight.size)), photo.sample)
        gain, offset = (torch.tensor(v, device=self.device) for v in run.exposures.gain_and_offset(index))
        exposed = gain * image + offset
        if task.collects_errors(run.step):
            squared = (exposed - photo.image).square().mean(2) * photo.weight
            run.add_errors(cuda.download(self.raster.contribute(last, squared[..., None])[2][:, 0]))
        _, gradient = differentiate_loss(exposed, photo.image, photo.weight, STRUCTURE)
        gradient = gain * gradient
        gradients = self.raster.differentiate(last, gradient, -BACKDROP * (gradient * behind).sum(2))
        hold_ground(gradients, task.constraints, smooth)
        self._step_adam_on_device(run, task, gradients, cuda.find_visible(last))
        view.release()

    def perturb(self, run: TrainingState, task: TrainingTask) -> None:
        """See `Descent.perturb`: of the few that are nearly transparent, on a copy."""
        fixed = task.constraints.fixed
        rows = fixed + torch.nonzero(self.values["opacity_logits"][fixed:] < densification.LOOSE_LOGIT)[:, 0]
        loose = {name: cuda.download(self.values[name][rows]) for name in USED_BY_PERTURB}
        densification.perturb(loose, 0, perturbation(run, task), run.rng)
        self.values["means"][rows] = cuda.upload(loose["means"], self.device)

    def _step_adam_on_device(
        self, run: TrainingState, task: TrainingTask, gradients: dict[str, Tensor], rows: Bool[Tensor, "n"]
    ) -> None:
        """As `Descent._step_adam`."""
        rates = task.rates(run.step, self.values["colours"].shape[1])
        unbiased = [1 - beta ** (run.step + 1) for beta in BETAS]
        for name, value in self.values.items():
            four = value, gradients[name], self.first[name], self.second[name]
            value, g, m, v = (t.flatten(1) if t.ndim > 1 else t[:, None] for t in four)
            which = rows[:, None]
            m.copy_(torch.where(which, m.lerp(g, 1 - BETAS[0]), m))
            v.copy_(torch.where(which, v.lerp(g * g, 1 - BETAS[1]), v))
            move = m / unbiased[0] / ((v / unbiased[1]).sqrt() + EPSILON)
            rate = torch.tensor(np.asarray(rates[name], np.float32), device=self.device)
            value.sub_(torch.where(which, rate * move, 0))

    def _find_photo(self, view: TrainingView, index: int) -> Photo:
        """A view on the device; kept there while there is room."""
        if (photo := self._photos.get(index)) is None:
            image, weight = (cuda.upload(np.ascontiguousarray(a), self.device) for a in (view.image, view.weight))
            behind = None if view.behind is None else cuda.upload(np.ascontiguousarray(view.behind), self.device)
            photo = Photo(image, weight, behind, exposure.sample_photo(view.image, view.weight))
            if sum(each.weight.nelement() for each in self._photos.values()) + view.weight.size <= CACHE:
                self._photos[index] = photo
        return photo


def smooth(values: Float32[Tensor, "rows columns"], cells: float) -> Float32[Tensor, "rows columns"]:
    """As `ground.smooth`: Gaussian blur over the grid; borders repeat."""
    width = 2 * int(4 * cells + 0.5) + 1  # as SciPy's
    return gaussian_blur2d(values[None, None], (width, width), (cells, cells), "replicate")[0, 0]
