"""What single things on the ground are judged by."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array


@dataclass(frozen=True)
class Surroundings:
    """What things are judged by, of every cell.

    Attributes:
        colour: sRGB in [0, 1].
        features: weighed CIELAB.
        rise: how far what is seen from above lies over the ground around it, in cells.
        materials: the nearest material.
        ground: whether it is ground of a material.
        pieces: whether it is a small piece of one material within another.
        strips: whether it is of a strip.
        known: whether a photo saw it.
        rough: numbers of the materials that are dense with growth or stones.
    """

    colour: Float[Array, "m m 3"]
    features: Float[Array, "m m k"]
    rise: Float[Array, "m m"]
    materials: Int[Array, "m m"]
    ground: Bool[Array, "m m"]
    pieces: Bool[Array, "m m"]
    strips: Bool[Array, "m m"]
    known: Bool[Array, "m m"]
    rough: frozenset[int]

    def material_of(self, own: Bool[Array, "m m"]) -> int:
        """The material that most of a thing lies on."""
        return int(np.bincount(self.materials[own]).argmax())

    def plain(self, material: int) -> Bool[Array, "m m"]:
        """Ground of a material without things."""
        return self.ground & (self.materials == material)
