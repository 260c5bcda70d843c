"""Repair pictures of a seam by a prior."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, cast, runtime_checkable

from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.threads import one_thread

CELL = 4  # pixels per side of a cell of the latent
TOUCHED = 0.25  # share of the full bounds in a cell, from which its render is not valid

Repair = Callable[[Condition, Float32[Array, "b s s"]], Float32[Array, "b s s 3"]]
"""From the condition of b pictures, and the nearness of their pixels to a seam (0 to 1), to what is added to them."""


@runtime_checkable
class Repairer(Prior, Protocol):
    """A prior that can denoise a picture to which a little noise was added."""

    def repair(
        self,
        condition: Condition,
        strength: float,
        steps: int,
        seed: int,
        known: Bool[Array, "b h w"] | None = None,
    ) -> Float32[Array, "b c hz wz"]:
        """See `TerrainPrior.repair`."""
        ...


@dataclass(frozen=True)
class PriorRepair:
    """Adds the difference that the repair makes to an encoded picture, without the loss of the autoencoder.

    render_is_valid: whether the render beside the seam counts as valid.
    """

    model: Repairer
    strength: float
    steps: int = 4
    seed: int = 0
    render_is_valid: bool = False

    @classmethod
    def from_config(cls, model: Prior, entry: dict, seed: int) -> "PriorRepair":
        """The repair under `refine` of an entry of the config."""
        steps, valid = entry.get("steps", cls.steps), entry.get("condition", cls.render_is_valid)
        return cls(cast(Repairer, model), entry["strength"], steps, seed, valid)

    def __call__(self, condition: Condition, near: Float32[Array, "b s s"]) -> Float32[Array, "b s s 3"]:
        b, size = len(condition), condition.colour.shape[1]
        cells = near.reshape(b, size // CELL, CELL, size // CELL, CELL).max((2, 4))
        known = None if self.render_is_valid else cells <= TOUCHED
        with one_thread():
            made = self.model.repair(condition, self.strength, self.steps, self.seed, known)
            after, before = (
                self.model.decode(codes).rgba[..., :3] for codes in (made, self.model.encode_render(condition))
            )
        return after - before
