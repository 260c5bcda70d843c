"""Pictures of a cut, repaired: what a prior, or something to compare it with, would add to them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.threads import one_thread

CELL = 4  # pixels a side of a cell of the code: what a prior believes or not
TOUCHED = 0.25  # share of the full bounds that a cell shows somewhere, from which it is not believed
SOFT = 3.0  # pixels: how widely a feather mixes the two sides of a cut

Repair = Callable[[Condition, Float32[Array, "b s s"]], Float32[Array, "b s s 3"]]
"""From what is known of b pictures, and how near to a cut their pixels are (0 to 1), to what is to be added to them."""


@runtime_checkable
class Repairer(Prior, Protocol):
    """A prior that goes on from a picture to which a little noise was added."""

    def repair(
        self,
        condition: Condition,
        strength: float,
        steps: int,
        seed: int,
        known: Bool[Array, "b h w"] | None = None,
    ) -> Float32[Array, "b c hz wz"]:
        """The latents of what the field shows, noised to `strength` of the schedule (0: not at all) by one noise for
        all views, and denoised in `steps` steps without dropout. known: cells whose render is to be believed."""


@dataclass(frozen=True)
class ByPrior:
    """Adds the difference that repairing makes to a coded picture: what the coder alone loses is no repair.

    believed: whether the prior is told that the render beside the cut is to be believed, too.
    """

    model: Repairer
    strength: float
    steps: int = 4
    seed: int = 0
    believed: bool = False

    @classmethod
    def of(cls, model: Prior, entry: dict, seed: int) -> "ByPrior":
        """Of what an entry of the config's `seams` says under `refine`."""
        given = {key: entry[key] for key in ("steps", "believed") if key in entry}
        return cls(model, entry["strength"], seed=seed, **given)

    def __call__(self, condition: Condition, near: Float32[Array, "b s s"]) -> Float32[Array, "b s s 3"]:
        b, size = len(condition), condition.colour.shape[1]
        cells = near.reshape(b, size // CELL, CELL, size // CELL, CELL).max((2, 4))
        known = None if self.believed else cells <= TOUCHED
        with one_thread():
            made = self.model.repair(condition, self.strength, self.steps, self.seed, known)
            after, before = (
                self.model.decode(codes).rgba[..., :3] for codes in (made, self.model.encode_render(condition))
            )
        return after - before


def feathered(condition: Condition, near: Float32[Array, "b s s"]) -> Float32[Array, "b s s 3"]:
    """A plain blur beside the cut, to compare a prior with."""
    soft = gaussian_filter(condition.colour, (0, SOFT, SOFT, 0), mode="nearest")
    return (near[..., None] * (soft - condition.colour)).astype(np.float32)
