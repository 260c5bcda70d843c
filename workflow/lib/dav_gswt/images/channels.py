"""Arithmetic on images of few channels, one channel after the other.

NumPy's loop over a last axis of 3 takes ten times as long as the arithmetic. The results have the same bits.
"""

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array


def composite(
    colour: Float32[Array, "h w c"], alpha: Float32[Array, "h w"], behind: Float32[Array, "*#hw c"]
) -> Float32[Array, "h w c"]:
    """colour + (1 - alpha) behind. behind: a colour, or one a pixel."""
    left, out = 1 - alpha, np.empty_like(colour)
    for c in range(colour.shape[2]):
        np.multiply(left, behind[..., c], out=out[..., c])
    out += colour
    return out


def scale_channels(
    image: Float32[Array, "h w c"], gain: Float32[Array, "c"], offset: Float32[Array, "c"] | None = None
) -> Float32[Array, "h w c"]:
    """gain image + offset, by channel; a new array."""
    width = image.shape[1]
    rows = image.reshape(len(image), -1) * np.tile(gain, width)
    if offset is not None:
        rows += np.tile(offset, width)
    return rows.reshape(image.shape)


def sum_products(one: Float32[Array, "h w c"], other: Float32[Array, "*#hw c"]) -> Float32[Array, "h w"]:
    """Sum over the channels of one times other. other: an image, or one value a channel."""
    total = one[..., 0] * other[..., 0]
    for c in range(1, one.shape[2]):
        total += one[..., c] * other[..., c]
    return total


def fill_unknown(image: Float32[Array, "h w c"], colour: Float32[Array, "c"]) -> Float32[Array, "h w c"]:
    """The image with a colour where it is NaN."""
    out = image.copy()
    for c in range(image.shape[2]):
        plane = out[..., c]
        np.copyto(plane, colour[c], where=np.isnan(plane))
    return out
