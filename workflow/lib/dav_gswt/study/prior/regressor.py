"""A deterministic regressor with the architecture of the prior: the control that diffusion has to beat.

It predicts the latent of a view in one pass, from zeros at time 0: the mean of all possible views, so blurred where
they differ. See `optimization.train_denoiser`.
"""

import numpy as np
import torch
from jaxtyping import Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import sampler
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import LATENT
from dav_gswt.prior.sampler import Sampling
from dav_gswt.prior.terrain import LatentModel


class Regressor(LatentModel):
    """The regressor of a weights file that `pipeline.train_prior` wrote."""

    name, is_regressor = "regressor", True

    def predict(self, condition: Condition) -> Float32[Array, "b c hz wz"]:
        """The latent of each view, without dropout."""
        return np.ascontiguousarray(self.sample(condition, 1, 0.0, 0)[:, 0])

    def sample(self, condition: Condition, m: int, p_drop: float, seed: int) -> Float32[Array, "b m c hz wz"]:
        """m predictions of each view, each under an attention dropout mask of its own; p_drop = 0: m equal predictions.

        They do not depend on the batch (to 1e-5). Raises: ValueError: m < 1, or p_drop outside [0, 1).
        """
        denoise, sampling = self.make_denoiser(condition), Sampling(m, p_drop, 1, seed)

        def run(zeros: Tensor, rows: slice) -> Tensor:
            return denoise(zeros, torch.tensor(0), rows)

        return sampler.run_with_masks(run, self.layers, torch.zeros(1, *LATENT), len(condition), sampling)
