"""The interface of a generative prior: it samples several possible pictures of a view, given what is known of it."""

from dataclasses import dataclass, fields
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.field import Rows


@dataclass(frozen=True)
class Condition(Rows):
    """What is known of b views, of s x s pixels each; colours sRGB in [0, 1].

    colour, alpha: the field rendered at the pose, colour over black. inverse_depth: flying height over depth, 0 where
    the render is empty. photo: the captured photo nearest to the pose. relative: the pose relative to that photo:
    difference of elevation in radians, sine and cosine of the difference of azimuth, difference of radius over the
    flying height.
    """

    colour: Float32[Array, "b s s 3"]
    alpha: Float32[Array, "b s s"]
    inverse_depth: Float32[Array, "b s s"]
    photo: Float32[Array, "b s s 3"]
    relative: Float32[Array, "b 4"]

    def check(self) -> None:
        """Raises: ValueError: a value is not finite; the message names the array and the first such view."""
        for f in fields(self):
            values = getattr(self, f.name)
            good = np.isfinite(values).reshape(len(self), -1).all(1)
            if not good.all():
                raise ValueError(f"{f.name} of view {int(np.argmin(good))} is not finite")


@runtime_checkable
class Prior(Protocol):
    """A generative model of views. name: as in the config. size: pixels per side of its pictures.

    small: so small that every thread can have a copy of its own.
    """

    name: str
    size: int
    small: bool

    def sample(
        self, condition: Condition, m: int, p_drop: float, steps: int, seed: int, common: bool = True
    ) -> Float32[Array, "b m c hz wz"]:
        """Draw m latents of each view by DDIM with eta = 0, each under an attention dropout mask of its own.

        One mask holds for a whole trajectory. p_drop = 0 with common noise gives m equal latents, to the bit. The
        latents of a view do not depend on its batch (to 1e-5).

        Args:    common: all samples start from one noise and differ by dropout alone. False: each of the m samples
                 starts from a noise of its own, the same for every view.
        Raises:  ValueError: m < 1, steps < 1, or p_drop outside [0, 1).
        """
        ...

    def decode(self, latents: Float32[Array, "*n c hz wz"]) -> Float32[Array, "*n s s 4"]:
        """The pictures of latents: colours over black, and opacity."""
        ...
