"""From noise to latents: DDIM without added noise (eta = 0), so that only dropout tells samples apart."""

from collections.abc import Callable

import numpy as np
import torch
from diffusers import DDIMScheduler
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from torch import Tensor

from dav_gswt.prior import dropout
from dav_gswt.prior.dropout import HeldDropout

Denoise = Callable[[Tensor, Tensor, slice], Tensor]  # latents, time, which views: the network's prediction
Run = Callable[[Tensor, slice], Tensor]  # where latents start, which views: where they end


def sampled(
    denoise: Denoise,
    layers: list[HeldDropout],
    schedule: DDIMScheduler,
    views: int,
    shape: tuple[int, ...],
    m: int,
    p_drop: float,
    steps: int,
    seed: int,
    batch: int = 32,
    common: bool = True,
) -> Float32[Array, "b m c h w"]:
    """Latents of `views` views, m of each: one common noise, one mask a sample and trajectory.

    denoise: predicts for latents of whole views, m of each, one after the other. shape: of a latent. batch: latents at
    a time; changes no result beyond rounding. common: one noise for all samples; else one a sample, the same for every
    view, the first of them the common one. p_drop = 0 with the common noise: one trajectory, m times the same bits.
    Raises: ValueError: m < 1, steps < 1, p_drop outside [0, 1), or latents that are not finite, naming the view.
    """
    if steps < 1 or m < 1:
        raise ValueError(f"steps is {steps} and m is {m}; there is at least one of each")
    generator = torch.Generator().manual_seed(seed)
    noises = torch.stack([torch.randn(shape, generator=generator) for _ in range(1 if common else m)])

    def run(start: Tensor, some: slice) -> Tensor:
        return _trajectory(denoise, schedule, start, steps, some)

    return masked(run, layers, noises, views, m, p_drop, seed, batch)


def repaired(
    denoise: Denoise,
    layers: list[HeldDropout],
    schedule: DDIMScheduler,
    codes: Float[Tensor, "b c h w"],
    strength: float,
    steps: int,
    seed: int,
    batch: int = 32,
) -> Float32[Array, "b c h w"]:
    """Codes to which a little noise is added, the same to all, and which are denoised from there (SDEdit).

    strength: the share of the schedule to go back by; 0: the codes themselves, 1: from noise alone. Without dropout
    and added noise (eta = 0), in `steps` steps, the last ones of a schedule with steps / strength of them.
    Raises: ValueError: steps < 1, strength outside [0, 1], or latents that are not finite, naming the view.
    Source: Meng et al., SDEdit, 2022.
    """
    if steps < 1 or not 0 <= strength <= 1:
        raise ValueError(f"steps is {steps} and strength {strength}; at least one step, a strength from 0 to 1")
    if strength == 0:
        return codes.numpy()
    noise = torch.randn(codes.shape[1:], generator=torch.Generator().manual_seed(seed))
    out = []
    with torch.inference_mode(), dropout.masks(layers, 1, 0.0, seed):
        for first in range(0, len(codes), batch):
            some = slice(first, min(first + batch, len(codes)))
            schedule.set_timesteps(round(steps / strength))
            times = schedule.timesteps[-steps:]
            latents = schedule.add_noise(codes[some], noise[None], times[:1])
            out.append(_denoised(denoise, schedule, latents, times, some))
    found = torch.cat(out).numpy()
    bad = ~np.isfinite(found).reshape(len(found), -1).all(1)
    if bad.any():
        raise ValueError(f"the prior's latents of view {int(np.argmax(bad))} are not finite")
    return found


def masked(
    run: Run,
    layers: list[HeldDropout],
    starts: Float[Tensor, "k c h w"],
    views: int,
    m: int,
    p_drop: float,
    seed: int,
    batch: int = 32,
) -> Float32[Array, "b m c h w"]:
    """Where m latents of each of `views` views end, each under a dropout mask of its own that it holds throughout.

    starts: of the samples, m or one for all; one and p_drop = 0: it is run once, m times the same bits.
    Raises: ValueError: m < 1, p_drop outside [0, 1), or latents that are not finite, naming the view.
    """
    with torch.inference_mode(), dropout.masks(layers, m, p_drop, seed):
        drawn = m if p_drop > 0 else len(starts)
        out = np.empty((views, drawn, *starts.shape[1:]), np.float32)
        each = max(1, batch // drawn)
        for first in range(0, views, each):
            some = slice(first, min(first + each, views))
            count = some.stop - some.start
            for layer in layers:
                layer.m = drawn
            found = run(starts.expand(drawn, -1, -1, -1).repeat(count, 1, 1, 1), some)
            out[some] = found.view(count, drawn, *starts.shape[1:]).float().numpy()
    bad = ~np.isfinite(out).reshape(views, -1).all(1)
    if bad.any():
        raise ValueError(f"the prior's latents of view {int(np.argmax(bad))} are not finite")
    return np.repeat(out, m // drawn, axis=1)


def _trajectory(
    denoise: Denoise, schedule: DDIMScheduler, latents: Float[Tensor, "n c h w"], steps: int, some: slice
) -> Float[Tensor, "n c h w"]:
    schedule.set_timesteps(steps)
    return _denoised(denoise, schedule, latents, schedule.timesteps, some)


def _denoised(
    denoise: Denoise, schedule: DDIMScheduler, latents: Float[Tensor, "n c h w"], times: Tensor, some: slice
) -> Float[Tensor, "n c h w"]:
    for time in times:
        predicted = denoise(latents, time, some)
        latents = schedule.step(predicted, time, latents, eta=0.0).prev_sample
    return latents
