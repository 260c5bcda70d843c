"""DDIM sampling without added noise (eta = 0): with common initial noise, samples differ by dropout alone."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import dropout
from dav_gswt.prior.dropout import HeldDropout

Denoiser = Callable[[Tensor, Tensor, slice], Tensor]  # latents, time, rows of the views -> the network's prediction
Schedule = Any  # a DDIMScheduler of diffusers, whose annotations reject the tensors that it takes
Trajectory = Callable[[Tensor, slice], Tensor]  # initial latents, rows of the views -> final latents


@dataclass(frozen=True)
class Sampling:
    """How to sample.

    m: samples per view. batch: latents at a time; changes results by rounding only. common: one initial noise for all
    samples; else one per sample, the same for every view, of which the first is the common one.
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
    noises = torch.stack([torch.randn(shape, generator=generator) for _ in range(1 if s.common else s.m)])

    def run(start: Tensor, rows: slice) -> Tensor:
        schedule.set_timesteps(s.steps)
        return _denoise_steps(denoise, schedule, start, schedule.timesteps, rows)

    return _run_with_masks(run, layers, noises, views, sampling)


def _run_with_masks(
    run: Trajectory, layers: list[HeldDropout], starts: Float[Tensor, "k c h w"], views: int, sampling: Sampling
) -> Float32[Array, "b m c h w"]:
    """Run m trajectories of each of `views` views, each under a dropout mask that it holds throughout.

    Args:    starts: initial latents, one per sample or one for all. With one and p_drop = 0 a view is run once.
    Raises:  ValueError: m < 1, p_drop outside [0, 1), or a latent is not finite, naming the view.
    """
    m, p_drop = sampling.m, sampling.p_drop
    with torch.inference_mode(), dropout.hold_masks(layers, m, p_drop, sampling.seed):
        distinct = m if p_drop > 0 else len(starts)
        out = np.empty((views, distinct, *starts.shape[1:]), np.float32)
        each = max(1, sampling.batch // distinct)
        for first in range(0, views, each):
            rows = slice(first, min(first + each, views))
            count = rows.stop - rows.start
            for layer in layers:
                layer.m = distinct
            latents = run(starts.expand(distinct, -1, -1, -1).repeat(count, 1, 1, 1), rows)
            out[rows] = latents.view(count, distinct, *starts.shape[1:]).float().numpy()
    _require_finite(out)
    return np.repeat(out, m // distinct, axis=1)


def repair_latents(
    denoise: Denoiser,
    layers: list[HeldDropout],
    schedule: Schedule,
    latents: Float[Tensor, "b c h w"],
    strength: float,
    sampling: Sampling,
) -> Float32[Array, "b c h w"]:
    """Add a little noise to latents, the same to all, and denoise them from there (SDEdit), without dropout.

    Args:    strength: share of the schedule to go back by; 0: the latents themselves, 1: from noise alone. The `steps`
             steps are the last ones of a schedule of steps / strength.
    Raises:  ValueError: steps < 1, strength outside [0, 1], or a latent is not finite, naming the view.
    Source:  Meng et al., SDEdit, 2022.
    """
    steps = sampling.steps
    if steps < 1 or not 0 <= strength <= 1:
        raise ValueError(f"steps is {steps} and strength {strength}; at least one step, a strength from 0 to 1")
    if strength == 0:
        return latents.numpy()
    noise = torch.randn(latents.shape[1:], generator=torch.Generator().manual_seed(sampling.seed))
    parts = []
    with torch.inference_mode(), dropout.hold_masks(layers, 1, 0.0, sampling.seed):
        for first in range(0, len(latents), sampling.batch):
            rows = slice(first, min(first + sampling.batch, len(latents)))
            schedule.set_timesteps(round(steps / strength))
            times = schedule.timesteps[-steps:]
            noisy = schedule.add_noise(latents[rows], noise[None], times[:1])
            parts.append(_denoise_steps(denoise, schedule, noisy, times, rows))
    out = torch.cat(parts).numpy()
    _require_finite(out)
    return out


def _require_finite(latents: Float32[Array, "b *rest"]) -> None:
    bad = ~np.isfinite(latents).reshape(len(latents), -1).all(1)
    if bad.any():
        raise ValueError(f"the prior's latents of view {int(np.argmax(bad))} are not finite")


def _denoise_steps(
    denoise: Denoiser, schedule: Schedule, latents: Float[Tensor, "n c h w"], times: Tensor, rows: slice
) -> Float[Tensor, "n c h w"]:
    for time in times:
        latents = schedule.step(denoise(latents, time, rows), time, latents, eta=0.0).prev_sample
    return latents
