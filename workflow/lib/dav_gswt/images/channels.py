"""Arithmetic on images of few channels: arrays or tensors; of arrays one channel after the other.

NumPy's loop over a last axis of 3 takes ten times as long as the arithmetic. The results have the same bits.
"""

from typing import Any

import numpy as np
from jaxtyping import Float32

from dav_gswt.arrays import namespace


def composite(
    colour: Float32[Any, "h w c"], alpha: Float32[Any, "h w"], behind: Float32[Any, "*#hw c"]
) -> Float32[Any, "h w c"]:
    """colour + (1 - alpha) behind. behind: a colour, or one a pixel."""
    if not isinstance(colour, np.ndarray):
        return colour + (1 - alpha)[..., None] * behind
    left, out = 1 - alpha, np.empty_like(colour)
    for c in range(colour.shape[2]):
        np.multiply(left, behind[..., c], out=out[..., c])
    out += colour
    return out


def scale_channels(
    image: Float32[Any, "h w c"], gain: Float32[Any, "c"], offset: Float32[Any, "c"] | None = None
) -> Float32[Any, "h w c"]:
    """gain image + offset, by channel; a new array."""
    if not isinstance(image, np.ndarray):
        return image * gain + (0 if offset is None else offset)
    width = image.shape[1]
    rows = image.reshape(len(image), -1) * np.tile(gain, width)
    if offset is not None:
        rows += np.tile(offset, width)
    return rows.reshape(image.shape)


def sum_products(one: Float32[Any, "h w c"], other: Float32[Any, "*#hw c"]) -> Float32[Any, "h w"]:
    """Sum over the channels of one times other. other: an image, or one value a channel."""
    total = one[..., 0] * other[..., 0]
    for c in range(1, one.shape[2]):
        total += one[..., c] * other[..., c]
    return total


def fill_unknown(image: Float32[Any, "h w c"], colour: Float32[Any, "c"]) -> Float32[Any, "h w c"]:
    """The image with a colour where it is NaN."""
    if not isinstance(image, np.ndarray):
        return namespace(image).where(image.isnan(), colour, image)
    out = image.copy()
    for c in range(image.shape[2]):
        plane = out[..., c]
        np.copyto(plane, colour[c], where=np.isnan(plane))
    return out
