"""DDIM sampling without added noise (eta = 0): with common initial noise, samples differ by attention dropout alone.

The attention of diffusers ends in a Dropout that draws a new mask at every step and for every element of a batch. Here
each sample of a view has one mask, drawn from the seed and held for all steps; all views share the masks (common random
numbers), so differences between views are due to the views, and the samples of a view do not depend on its batch.
"""

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from torch import Tensor, nn

Denoiser = Callable[[Tensor, Tensor, slice], Tensor]  # latents, time, rows of the views -> the network's prediction
Schedule = Any  # a DDIMScheduler of diffusers, whose annotations reject the tensors that it takes


class HeldDropout(nn.Module):
    """Replaces a Dropout. A batch holds `m` samples of one view, then m of the next, and so on.

    x -> x * mask / (1 - p), with a mask of shape (m, *x.shape[1:]). The identity until `begin` is called.
    """

    def __init__(self, number: int):
        super().__init__()
        self.number = number  # of this layer: each layer draws other masks
        self.m, self.p, self.seed, self.mask = 1, 0.0, 0, None

    def begin(self, m: int, p: float, seed: int) -> None:
        """Forget the mask; the next forward pass draws another."""
        self.m, self.p, self.seed, self.mask = m, p, seed, None

    def forward(self, x: Float[Tensor, "bm *rest"]) -> Float[Tensor, "bm *rest"]:
        """Raises: ValueError: the batch size is not a multiple of m."""
        if self.p == 0:
            return x
        if len(x) % self.m:
            raise ValueError(f"a batch of {len(x)} does not hold whole views of {self.m} samples")
        if self.mask is None or self.mask.shape[1:] != x.shape[1:]:
            self.mask = self._draw_mask(x.shape[1:]).to(x)
        views = x.view(-1, self.m, *x.shape[1:])
        return (views * self.mask).view_as(x)

    def _draw_mask(self, shape: torch.Size) -> Float[Tensor, "m *rest"]:
        generator = torch.Generator().manual_seed((self.seed * 1_000_003 + self.number) % 2**63)
        kept = torch.rand((self.m, *shape), generator=generator) >= self.p
        return kept / (1 - self.p)


def replace_dropout(network: nn.Module) -> list[HeldDropout]:
    """Put a HeldDropout in place of the Dropout behind every attention of a diffusers network.

    Raises: ValueError: the network has no attention.
    """
    layers = []
    for name, part in network.named_modules():
        if name.endswith("to_out") and isinstance(part, nn.ModuleList) and len(part) == 2:
            part[1] = HeldDropout(len(layers))
            layers.append(part[1])
    if not layers:
        raise ValueError("the network has no attention whose output could be dropped out")
    return layers


@contextmanager
def hold_masks(layers: list[HeldDropout], m: int, p: float, seed: int):
    """Hold the masks of one trajectory. Raises: ValueError: p outside [0, 1)."""
    if not 0 <= p < 1:
        raise ValueError(f"p_drop is {p}; it must be at least 0 and less than 1")
    for layer in layers:
        layer.begin(m, p, seed)
    try:
        yield
    finally:
        for layer in layers:
            layer.begin(1, 0.0, 0)


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
    with torch.inference_mode(), hold_masks(layers, distinct, s.p_drop, s.seed):
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
