"""Seam-LPIPS: does a crop look like something that occurs in the exemplar?

LPIPS is a squared distance of weighted unit features, so every crop is a vector and a distance to a whole bank one
matrix product. Seam-LPIPS of a crop is the mean of its NEAREST smallest distances to a bank of crops of the exemplar,
its trend taken out, drawn in the same view; crops that overlap what the crop itself is made of are left out.

It needs no reference, so it can be told where two patches meet. It is never 0: the floor, the same of the patches that
meet, each laid whole and counted where the crop shows it, says how far the exemplar's own places are from one another.
Were each counted everywhere, what it has outside its part would be most of the difference.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float32, Float64, Int
from numpy import ndarray as Array
from torch.nn import functional

from dav_gswt.errors import InputError
from dav_gswt.images import lpips
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.threads import one_thread

NEAREST = 3  # chosen, as the size of crops and of the bank, on brighton_beach
AT_A_TIME = 64  # crops whose features are held


Shapes = list[tuple[int, int, int]]  # channels, rows and columns of each layer


def embedded(pictures: Float32[Array, "n h w 3"], weights: Weights) -> tuple[Float32[Array, "n d"], Shapes]:
    """Vectors whose squared distances are LPIPS, and how they are made up. pictures: in [0, 1].

    Raises: as `lpips.layers`.
    """
    parts, shapes = [], []
    with one_thread():
        for start in range(0, len(pictures), AT_A_TIME):
            some = lpips.layers(2 * pictures[start : start + AT_A_TIME] - 1, weights)
            shapes = [layer.shape[1:] for layer in some]
            parts.append(np.concatenate([_flat(f, h) for f, h in zip(some, weights.heads, strict=True)], 1))
    return np.concatenate(parts), shapes


def _flat(features: Float32[Array, "n c h w"], head: Float32[Array, "c"]) -> Float32[Array, "n d"]:
    length = np.sqrt((features**2).sum(1, keepdims=True)) + np.float32(1e-10)
    pixels = features.shape[2] * features.shape[3]
    return (features / length * np.sqrt(head / pixels)[:, None, None]).reshape(len(features), -1)


def where(masks: Float32[Array, "k h w"], shapes: Shapes) -> Float32[Array, "k d"]:
    """How much of each mask every entry of a vector sees: the mask's mean over its share of the picture."""
    pooled = []
    for channels, rows, columns in shapes:
        small = functional.adaptive_avg_pool2d(torch.from_numpy(masks)[:, None], (rows, columns)).numpy()
        pooled.append(np.repeat(small, channels, axis=1).reshape(len(masks), -1))
    return np.concatenate(pooled, 1)


def distances(crops: Float32[Array, "n d"], bank: Float32[Array, "m d"]) -> Float64[Array, "n m"]:
    """LPIPS of every crop to every one of the bank."""
    with one_thread(), torch.inference_mode():
        a, b = (torch.from_numpy(each).double() for each in (crops, bank))
        apart = (a * a).sum(1)[:, None] + (b * b).sum(1) - 2 * a @ b.T
        return apart.clamp(min=0).numpy()


def nearest(apart: Float64[Array, "n m"], allowed: Bool[Array, "m"], count: int = NEAREST) -> Int[Array, "n count"]:
    """Which of the bank are nearest to each crop, of those allowed. Raises: InputError: they are fewer."""
    if allowed.sum() < count:
        raise InputError(
            "seams: the exemplar holds nothing beside what a crop itself is made of, so nothing tells what it should "
            "look like; a smaller `tile` in the config's seams, or photos of a larger ground, leave more"
        )
    return np.argsort(np.where(allowed, apart, np.inf), axis=1, kind="stable")[:, :count]


def floor(own: Float32[Array, "k d"], like: list[Float32[Array, "count d"]], shown: Float32[Array, "k d"]) -> float:
    """Mean distance of patches that are laid whole to their nearest ones, each counted where the crop shows it.

    shown: `where` of the patches' masks, which sum to 1 everywhere.
    """
    parts = [
        float((((near - v).astype(float) ** 2).mean(0) * s).sum()) for v, near, s in zip(own, like, shown, strict=True)
    ]
    return sum(parts)


def apart_from(boxes: Int[Array, "k 2 2"], bank: Int[Array, "m 2 2"]) -> Bool[Array, "m"]:
    """Which of the bank overlap none of a crop's own places; boxes of exemplar cells, both ends included."""
    low, high = boxes[:, None, 0] <= bank[None, :, 1], boxes[:, None, 1] >= bank[None, :, 0]
    return ~(low & high).all(-1).any(0)
