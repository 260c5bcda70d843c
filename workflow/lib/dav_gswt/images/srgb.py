"""Curves of colours: sRGB's (IEC 61966-2-1), and HDR pictures as usual ones.

HDR has two transfer curves (ITU-R BT.2100) and wide colours (BT.2020).
"""

from functools import cache
from typing import Literal

import numpy as np
from jaxtyping import Float, Float32, UInt8, UInt16
from numpy import ndarray as Array

Curve = Literal["hlg", "pq"]
WHITE = {"hlg": 0.2650, "pq": 0.0203}  # light of a white sheet (BT.2408), as a share of the brightest
WIDE_TO_USUAL = np.array(  # light in BT.2020's primaries to light in BT.709's (BT.2087)
    [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]], np.float32
)


def encode_srgb(light: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Linear light to sRGB, clipped to [0, 1]."""
    light = np.clip(light, 0.0, 1.0)
    curve = 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curve).astype(light.dtype)


def decode_srgb(colour: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """sRGB in [0, 1] to linear light."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


def convert_hdr(values: UInt16[Array, "h w 3"], curve: Curve) -> UInt8[Array, "h w 3"]:
    """A picture as sRGB. values: 0 to 65535. A white sheet becomes white; what is brighter is cut off."""
    light = _tabulate_light(curve)[values] @ WIDE_TO_USUAL.T
    return np.rint(255 * encode_srgb(light)).astype(np.uint8)


@cache
def _tabulate_light(curve: Curve) -> Float32[Array, "65536"]:
    """The light of each value, 1 for a white sheet."""
    signal = np.arange(65536) / 65535
    if curve == "hlg":
        light = np.where(signal <= 0.5, signal**2 / 3, (np.exp((signal - 0.55991073) / 0.17883277) + 0.28466892) / 12)
    else:
        root = signal ** (1 / 78.84375)
        light = (np.maximum(root - 0.8359375, 0) / (18.8515625 - 18.6875 * root)) ** (1 / 0.1593017578125)
    return (light / WHITE[curve]).astype(np.float32)
