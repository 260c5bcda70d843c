"""Where Gaussians may be and what they may look like: the caller's knowledge of the scene, asked at every step."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from dav_gswt.raster import Gradients

NEEDLE = np.log(3.0)  # the longest axis against the middle one: flat things are welcome, needles are not
FLAT = np.log(10.0)  # the longest axis against the shortest
LOGITS = (-8.0, 6.0)


@runtime_checkable
class Rules(Protocol):
    """A scene's rules. The first `fixed` Gaussians are never removed, moved away or made to jump; the first `discs` of
    them are the ground's."""

    fixed: int
    discs: int
    reach: float  # unit of length: what a detail of this scene measures

    def guide(self, gradients: Gradients) -> None:
        """Change gradients, in place, before the optimiser sees them."""

    def keep(self, values: dict[str, Array]) -> None:
        """Bring parameters back, in place, into what they may be."""

    def lost(self, values: dict[str, Array]) -> Bool[Array, "n"]:
        """Which Gaussians are where none can be: they go, and others take their places."""


class Anywhere:
    """Rules of a scene of which nothing is known (ordinary 3D Gaussian splatting): sizes are bounded, places are not.

    reach: the typical distance between neighbours. extent: the scene's size.
    """

    def __init__(self, reach: float, extent: float):
        self.fixed, self.discs, self.reach, self.extent = 0, 0, reach, extent

    def guide(self, gradients: Gradients) -> None:
        """Nothing to add."""

    def keep(self, values: dict[str, Array]) -> None:
        """Neither needles nor Gaussians as large as the scene."""
        bounded(values["log_scales"], 0.02 * self.reach, 0.1 * self.extent)
        np.clip(values["opacity_logits"], *LOGITS, out=values["opacity_logits"])

    def lost(self, values: dict[str, Array]) -> Bool[Array, "n"]:
        """None."""
        return np.zeros(len(values["means"]), bool)


def bounded(log_scales: Array, least: float, most: float) -> None:
    """Clip sizes, in place, and make needles thicker: no axis under the longest by more than FLAT, and the middle one
    by no more than NEEDLE."""
    np.clip(log_scales, np.log(least), np.log(most), out=log_scales)
    if not len(log_scales):
        return
    longest = log_scales.max(1, keepdims=True)
    np.maximum(log_scales, longest - FLAT, out=log_scales)
    middle = np.argsort(log_scales, axis=1)[:, 1:2]
    raised = np.maximum(np.take_along_axis(log_scales, middle, 1), longest - NEEDLE)
    np.put_along_axis(log_scales, middle, raised, 1)
