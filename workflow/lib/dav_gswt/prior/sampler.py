"""DDIM sampling without added noise (eta = 0): with common initial noise, samples differ by dropout alone."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import dropout
from dav_gswt.prior.dropout import HeldDropout

Denoiser = Callable[[Tensor, Tensor, slice], Tensor]  # latents, time, rows of the views -> the network's prediction
Schedule = Any  # a DDIMScheduler of diffusers, whose annotations reject the tensors that it takes


@dataclass(frozen=True)
class Sampling:
    """How to sample.

    m: samples per view. batch: latents at a time; changes results by rounding only. common: one initial noise for all
    samples; else one per sample, the same for every view; the first of them is the common one.
    """

    m: int
    p_drop: float
    steps: int
    seed: int
    batch: int = 32
    common: bool = True


def sample_latents(
    denoise: Denoiser,
    layers: list[HeldDropout],
    schedule: Schedule,
    views: int,
    shape: tuple[int, ...],
    sampling: Sampling,
) -> Float32[Array, "b m c h w"]:
    """Sample m latents of each of `views` views, one dropout mask per sample and trajectory.

    With p_drop = 0 and common noise one trajectory is run and repeated m times.

    Args:    denoise: takes latents of whole views, m of each, one view after the other. shape: of a latent.
    Raises:  ValueError: m < 1, steps < 1, p_drop outside [0, 1), or a latent is not finite, naming the view.
    """
    s = sampling
    if s.steps < 1 or s.m < 1:
        raise ValueError(f"steps is {s.steps} and m is {s.m}; there is at least one of each")
    generator = torch.Generator().manual_seed(s.seed)
    starts = torch.stack([torch.randn(shape, generator=generator) for _ in range(1 if s.common else s.m)])
    distinct = s.m if s.p_drop > 0 else len(starts)
    out = np.empty((views, distinct, *shape), np.float32)
    each = max(1, s.batch // distinct)
    with torch.inference_mode(), dropout.hold_masks(layers, distinct, s.p_drop, s.seed):
        for first in range(0, views, each):
            rows = slice(first, min(first + each, views))
            count = rows.stop - rows.start
            schedule.set_timesteps(s.steps)
            latents = starts.expand(distinct, -1, -1, -1).repeat(count, 1, 1, 1)
            for time in schedule.timesteps:
                latents = schedule.step(denoise(latents, time, rows), time, latents, eta=0.0).prev_sample
            out[rows] = latents.view(count, distinct, *shape).float().numpy()
    bad = ~np.isfinite(out).reshape(views, -1).all(1)
    if bad.any():
        raise ValueError(f"the prior's latents of view {int(np.argmax(bad))} are not finite")
    return np.repeat(out, s.m // distinct, axis=1)
