"""A deterministic regressor of the prior's shape: the control that diffusion has to beat to earn its cost.

It tells the code of a view in one pass, from zero noise at time 0: the mean of what may be there, so blurred where
much may be. See `training.train_denoiser`.
"""

import numpy as np
import torch
from jaxtyping import Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import sampler
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import CODE
from dav_gswt.prior.terrain import Learned


class Regressor(Learned):
    """A regressor from a file of weights that `lesson.learn(..., regress=True)` wrote."""

    name, regresses = "regressor", True

    def predicted(self, condition: Condition) -> Float32[Array, "b c hz wz"]:
        """The code of each view, without dropout."""
        return np.ascontiguousarray(self.samples(condition, 1, 0.0, 0)[:, 0])

    def samples(self, condition: Condition, m: int, p_drop: float, seed: int) -> Float32[Array, "b m c hz wz"]:
        """m predictions of each view, of another attention dropout each; p_drop = 0: m times the same bits.

        A view's do not depend on its batch (to 1e-5). Raises: ValueError: m < 1, or p_drop outside [0, 1).
        """
        denoise = self.told(condition)

        def run(nothing: Tensor, some: slice) -> Tensor:
            return denoise(nothing, torch.tensor(0), some)

        return sampler.masked(run, self.layers, torch.zeros(1, *CODE), len(condition), m, p_drop, seed)
