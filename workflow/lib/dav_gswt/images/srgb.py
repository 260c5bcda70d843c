"""sRGB's curve (IEC 61966-2-1)."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


def encode_srgb(light: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Linear light to sRGB, clipped to [0, 1]."""
    light = np.clip(light, 0.0, 1.0)
    curve = 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curve).astype(light.dtype)


def decode_srgb(colour: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """sRGB in [0, 1] to linear light."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
