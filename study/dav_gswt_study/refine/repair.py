"""Repair pictures of a seam by a prior."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import torch
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.prior import dropout
from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.prior.sampler import denoise_steps, require_finite
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.threads import one_thread

CELL = 4  # pixels per side of a cell of the latent
BATCH = 32  # latents at a time
TOUCHED = 0.25  # share of the full bounds in a cell, from which its render is not valid

Repair = Callable[[Condition, Float32[Array, "b s s"]], Float32[Array, "b s s 3"]]
"""From the condition of b pictures, and the nearness of their pixels to a seam (0 to 1), to what is added to them."""


def repair_latents(
    model: TerrainPrior,
    condition: Condition,
    strength: float,
    steps: int,
    seed: int,
    known: Bool[Array, "b h w"] | None = None,
) -> Float32[Array, "b c hz wz"]:
    """Add a little noise to the latents of the render, the same to all, and denoise them from there (SDEdit).

    Args:    strength: share of the schedule to go back by; 0: the latents themselves, 1: from noise alone. The `steps`
             steps are the last ones of a schedule of steps / strength. known: see `TerrainPrior.make_denoiser`.
    Raises:  ValueError: steps < 1, strength outside [0, 1], or a latent is not finite, naming the view.
    Source:  Meng et al., SDEdit, 2022.
    """
    if steps < 1 or not 0 <= strength <= 1:
        raise ValueError(f"steps is {steps} and strength {strength}; at least one step, a strength from 0 to 1")
    latents, schedule = torch.from_numpy(model.encode_render(condition)), model.schedule
    if strength == 0:
        return latents.numpy()
    denoise = model.make_denoiser(condition, known)
    noise = torch.randn(latents.shape[1:], generator=torch.Generator().manual_seed(seed))
    parts = []
    with torch.inference_mode(), dropout.hold_masks(model.layers, 1, 0.0, seed):
        for first in range(0, len(latents), BATCH):
            rows = slice(first, min(first + BATCH, len(latents)))
            schedule.set_timesteps(round(steps / strength))
            times = schedule.timesteps[-steps:]
            noisy = schedule.add_noise(latents[rows], noise[None], times[:1])
            parts.append(denoise_steps(denoise, schedule, noisy, times, rows))
    out = torch.cat(parts).numpy()
    require_finite(out)
    return out


@dataclass(frozen=True)
class PriorRepair:
    """Adds the difference that the repair makes to an encoded picture, without the loss of the autoencoder.

    render_is_valid: whether the render beside the seam counts as valid.
    """

    model: TerrainPrior
    strength: float
    steps: int = 4
    seed: int = 0
    render_is_valid: bool = False

    @classmethod
    def from_config(cls, model: Prior, entry: dict, seed: int) -> "PriorRepair":
        """The repair under `refine` of an entry of the config."""
        steps, valid = entry.get("steps", cls.steps), entry.get("condition", cls.render_is_valid)
        return cls(cast(TerrainPrior, model), entry["strength"], steps, seed, valid)

    def __call__(self, condition: Condition, near: Float32[Array, "b s s"]) -> Float32[Array, "b s s 3"]:
        b, size = len(condition), condition.colour.shape[1]
        cells = near.reshape(b, size // CELL, CELL, size // CELL, CELL).max((2, 4))
        known = None if self.render_is_valid else cells <= TOUCHED
        with one_thread():
            made = repair_latents(self.model, condition, self.strength, self.steps, self.seed, known)
            after, before = (
                self.model.decode(codes).rgba[..., :3] for codes in (made, self.model.encode_render(condition))
            )
        return after - before
