"""Shade: ground that may be other ground in less light."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

SHADE = 0.75  # of a material's light, in every channel, at most: darker and bluer is its shade
BLUER = 1.1  # ratio of blue light to red in the shade over that in the sun, at least


def linear_light(colour: Float[Array, "n 3"]) -> Float[Array, "3"]:
    """Mean linear light of sRGB colours."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4).mean(0)


def is_shade(light: Float[Array, "3"], other: Float[Array, "3"]) -> bool:
    """Whether ground of this light may be the other in shade: darker in all channels, and bluer, as the sky is."""
    ratio = light / np.maximum(other, 1e-6)
    return bool(ratio.max() < SHADE and ratio[2] >= BLUER * ratio[0] and ratio[1] >= ratio[0])
