"""What every prior is: something that, told what is known of a view, imagines several times what else it may show."""

from dataclasses import dataclass, fields
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array


@dataclass(frozen=True)
class Condition:
    """What is known of b views, of s x s pixels each; colours sRGB in [0, 1].

    colour, alpha: the field as it is, drawn at the pose (colour over black). inverse_depth: flying heights over depth,
    0 where nothing is. photo: the captured photo nearest to the pose. relative: from that photo to the pose:
    difference of elevation in radians, sine and cosine of the difference of azimuth, difference of the radius over the
    flying height.
    """

    colour: Float32[Array, "b s s 3"]
    alpha: Float32[Array, "b s s"]
    inverse_depth: Float32[Array, "b s s"]
    photo: Float32[Array, "b s s 3"]
    relative: Float32[Array, "b 4"]

    def __len__(self) -> int:
        return len(self.relative)

    def __getitem__(self, rows) -> "Condition":
        return Condition(*(getattr(self, f.name)[rows] for f in fields(self)))

    def check(self) -> None:
        """Raises: ValueError: something that is not finite, by its name and the first view that has it."""
        for f in fields(self):
            values = getattr(self, f.name)
            good = np.isfinite(values).reshape(len(self), -1).all(1)
            if not good.all():
                raise ValueError(f"{f.name} of view {int(np.argmin(good))} is not finite")


@dataclass(frozen=True)
class Imagined:
    """What a decoder makes of latents. rgba: colours over nothing, and opacity. inverse_depth: as in Condition; None
    where the prior knows no depth."""

    rgba: Float32[Array, "*n s s 4"]
    inverse_depth: Float32[Array, "*n s s"] | None


@runtime_checkable
class Prior(Protocol):
    """A generative model of views. name: as in the config. size: pixels a side of its pictures."""

    name: str
    size: int

    def samples(
        self, condition: Condition, m: int, p_drop: float, steps: int, seed: int, common: bool = True
    ) -> Float32[Array, "b m c hz wz"]:
        """m latents of each view: the same initial noise and eta = 0 for all, other attention dropout for each.

        common: False gives each of the m its own initial noise, the same for every view: what the prior holds for
        possible, rather than how firm it is.

        One dropout mask holds for a whole trajectory. p_drop = 0 gives m equal latents, to the bit. A view's latents
        do not depend on its batch (to 1e-5). Raises: ValueError: m < 1, steps < 1, or p_drop outside [0, 1).
        """

    def decoded(self, latents: Float32[Array, "*n c hz wz"]) -> Imagined:
        """The pictures of latents."""

    def shown(self, condition: Condition) -> Float32[Array, "b c hz wz"]:
        """The latents of what the field itself shows: what samples are, where it shows what the prior expects."""

    def variances(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n c hz wz"]:
        """How wide a distribution each latent stands for, where it is not taken for a point: the variance that the
        coder gives the code of its picture, in the latents' units."""
