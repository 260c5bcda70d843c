"""The steps of a fit on a GPU, where parameters, Adam's moments, exposures and photos stay: the backend `cuda`.

Between growth events nothing is read but one number every `trainer.CHECK_EVERY` steps and what gsplat reads itself; a
growth event reads positions, opacities and errors, and the rows that it copies. Two runs differ in the last bits: see
raster/cuda.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32, UInt8
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.arrays import on_host
from dav_gswt.raster import cuda
from dav_gswt.raster.interface import AdamStep, GaussianArrays
from dav_gswt.raster.torch import differentiate_loss, move_by_adam
from dav_gswt.reconstruction.fitting.densification import move_loose
from dav_gswt.reconstruction.fitting.descent import BETAS, STRUCTURE, Descent, TrainingState, TrainingTask, perturbation

EPSILON = 1e-15  # of Adam, as in `backends.adam`
CACHE = 500e6  # pixels of photos kept on the device, of 4 bytes, 7 with a sky; others are copied at every step


@dataclass(frozen=True)
class PackedImage:
    """Values low + step x byte, between 0 and 1, or their extremes if these are beyond; byte 0 is NaN if any is."""

    bytes: UInt8[Tensor, "h w *c"]
    low: float
    step: float
    has_unknown: bool

    def unpack(self) -> Float32[Tensor, "h w *c"]:
        """The values."""
        values = self.bytes.float() * self.step + self.low
        return torch.where(self.bytes == 0, torch.nan, values) if self.has_unknown else values


def pack_image(values: Float32[Array, "h w *c"], device: torch.device) -> PackedImage:
    """Round values to bytes on the device."""
    known = ~np.isnan(values)
    unknown = not known.all()
    low, high = (float(f(values, initial=edge, where=known)) for f, edge in ((np.min, 0.0), (np.max, 1.0)))
    step = (high - low) / (255 - unknown)
    levels = np.where(known, np.rint((np.where(known, values, low) - low) / step) + unknown, 0)
    return PackedImage(torch.as_tensor(levels.astype(np.uint8)).to(device), low - step * unknown, step, unknown)


@dataclass(frozen=True)
class Photo:
    """A view's values on the device."""

    camera: cuda.DeviceCamera
    image: Float32[Tensor, "h w 3"]
    weight: Float32[Tensor, "h w"]
    behind: Float32[Tensor, "h w 3"] | None


class DeviceDescent(Descent):
    """From `start` on the state and the exposures are tensors on the device."""

    def __init__(self, rasterizer: cuda.Rasterizer):
        self.raster, self.device = rasterizer, rasterizer.device
        self._cameras: list[cuda.DeviceCamera] = []
        self._packed: dict[int, dict[str, PackedImage]] = {}

    def start(self, run: TrainingState, task: TrainingTask) -> None:
        """See `Descent.start`."""
        run.state = run.state.convert(lambda array: torch.tensor(array, device=self.device))
        run.exposures.gains, run.exposures.offsets = (
            torch.tensor(array, device=self.device) for array in (run.exposures.gains, run.exposures.offsets)
        )
        seed = int(run.rng.spawn(1)[0].integers(1 << 62))  # the stream that growth and backgrounds read goes on
        self._generator: torch.Generator | None = torch.Generator(self.device).manual_seed(seed)
        self._cameras = [cuda.upload_camera(view.camera, self.device) for view in task.views]
        room = CACHE
        for index, view in enumerate(task.views):
            room -= view.weight.size
            if room >= 0:
                self._packed[index] = self._pack(task, index)

    def perturb(self, run: TrainingState, task: TrainingTask) -> None:
        """See `Descent.perturb`."""
        free = slice(task.constraints.fixed, None)
        shape = len(run.state) - task.constraints.fixed, 3
        noise = torch.randn(shape, device=self.device, generator=self._generator)
        move_loose(run.state.values, free, perturbation(run, task), noise)

    def check(self, run: TrainingState) -> None:
        """See `Descent.check`."""
        values = run.state.values
        if not math.isfinite(torch.stack([run.loss, *(value.sum() for value in values.values())]).sum().item()):
            GaussianArrays(**run.state.convert(on_host).values).check_values()
            raise ValueError("the loss of a fit is not finite")

    def measure_peaks(self, run: TrainingState, task: TrainingTask) -> Float32[Array, "n"]:
        """See `Descent.measure_peaks`."""
        peak = torch.zeros(len(run.state), device=self.device)
        for camera in self._cameras:
            last = self.raster.draw(run.state.values, camera)
            nothing = torch.empty(camera.height, camera.width, 0, device=self.device)
            peak = torch.maximum(peak, self.raster.contribute(last, nothing)[1])
            del last  # its graph, before the next one is drawn
        return on_host(peak)

    def _pack(self, task: TrainingTask, index: int) -> dict[str, Any]:
        view = task.views[index]
        images = {"image": view.image, "weight": view.weight, "behind": view.behind}
        packed = {name: pack_image(a, self.device) for name, a in images.items() if a is not None}
        view.release()
        return packed

    def _find_photo(self, task: TrainingTask, index: int) -> Photo:
        packed = self._packed.get(index) or self._pack(task, index)
        behind = packed["behind"].unpack() if "behind" in packed else None
        return Photo(self._cameras[index], packed["image"].unpack(), packed["weight"].unpack(), behind)

    def _bring(self, numbers: Float32[Array, "c"]) -> Float32[Tensor, "c"]:
        """A few numbers, as arguments of kernels: a copy would wait for all that is under way."""
        out = torch.empty(len(numbers), device=self.device)
        for i, number in enumerate(numbers):
            out[i : i + 1].fill_(float(number))
        return out

    def _draw(self, run: TrainingState, task: TrainingTask, camera: cuda.DeviceCamera) -> tuple[Tensor, Tensor]:
        self._last = self.raster.draw(run.state.values, camera)
        return self._last.picture.detach()[0, ..., :3], self._last.alpha.detach()[0, ..., 0]

    def _project_back(self, task: TrainingTask, errors: Float32[Tensor, "h w"]) -> Float32[Tensor, "n"]:
        return self.raster.project_back(self._last, errors)

    def _differentiate_loss(self, image: Float32[Tensor, "h w 3"], photo: Photo) -> tuple[Tensor, Tensor]:
        return differentiate_loss(image, photo.image, photo.weight, STRUCTURE)

    def _differentiate(self, task: TrainingTask, by_colour: Tensor, by_alpha: Tensor) -> dict[str, Any]:
        return self.raster.differentiate(self._last, by_colour, by_alpha)

    def _step_adam(self, run: TrainingState, task: TrainingTask, gradients: dict[str, Tensor]) -> None:
        rates = task.rates(run.step, run.state.values["colours"])
        rows = cuda.find_visible(self._last)[:, None].float()
        for name, value in run.state.values.items():
            four = value, gradients[name], run.state.first[name], run.state.second[name]
            value, g, m, v = (tensor.reshape(len(tensor), -1) for tensor in four)
            move_by_adam(AdamStep(value, g, m, v, rates[name], run.step + 1, BETAS, EPSILON, rows))
        del self._last  # its graph has been used, and the next one needs the room
