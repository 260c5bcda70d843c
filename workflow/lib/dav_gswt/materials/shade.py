"""Shade: ground that may be other ground in less light."""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import binary_closing, binary_dilation, gaussian_filter, label

SHADE = 0.75  # of a material's light, in every channel, at most: darker and bluer is its shade
BLUER = 1.1  # ratio of blue light to red in the shade over that in the sun, at least
RARE = 0.25  # of the ground, that its shade covers: more of it is texture
LEAST_AREA = 1.5e-3  # of the exemplar, of a piece of shade: what is between blades and stones is smaller
BESIDE = 1 / 32  # of the side: as near to excluded ground dapples of its shade lie
SOFT = 1 / 200  # of the side: blur of colours


def linear_light(colour: Float[Array, "n 3"]) -> Float[Array, "3"]:
    """Mean linear light of sRGB colours."""
    return to_linear(colour).mean(0)


def find_shade(
    colour: Float[Array, "m m 3"], ground: Bool[Array, "m m"], excluded: Bool[Array, "m m"]
) -> Bool[Array, "m m"]:
    """Cells of some ground that look like its shade: the dapples beside larger shade.

    Small pieces are texture, and so is shade that is everywhere or has no excluded ground beside it, as between tall
    grass. Args: colour: sRGB in [0, 1]. excluded: ground that is shown nowhere already.
    """
    if not (ground.any() and excluded.any()):
        return np.zeros_like(ground)
    soft = gaussian_filter(colour, (SOFT * len(colour), SOFT * len(colour), 0), mode="nearest")
    ratio = to_linear(soft) / np.maximum(np.median(to_linear(soft[ground]), 0), 1e-6)
    shade = (
        ground & (ratio.max(-1) < SHADE) & (ratio[..., 2] >= BLUER * ratio[..., 0]) & (ratio[..., 1] >= ratio[..., 0])
    )
    pieces, _ = label(binary_closing(shade))
    near = binary_dilation(excluded, iterations=max(1, round(BESIDE * len(colour))))
    large = np.bincount(pieces.ravel()) >= LEAST_AREA * shade.size
    large &= np.isin(np.arange(len(large)), pieces[near])
    large[0] = False
    found = large[pieces] & ground
    return found if found.sum() < RARE * ground.sum() else np.zeros_like(ground)


def to_linear(colour: Float[Array, "... 3"]) -> Float[Array, "... 3"]:
    """Linear light of sRGB colours."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


def is_shade(light: Float[Array, "3"], other: Float[Array, "3"]) -> bool:
    """Whether ground of this light may be the other in shade: darker in all channels, and bluer, as the sky is."""
    ratio = light / np.maximum(other, 1e-6)
    return bool(ratio.max() < SHADE and ratio[2] >= BLUER * ratio[0] and ratio[1] >= ratio[0])
