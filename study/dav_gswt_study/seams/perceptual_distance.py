"""Seam-LPIPS: the perceptual distance of a crop to the most similar crops of the exemplar.

LPIPS is a squared distance of weighted unit features, so every crop is a vector, and distances to a bank of crops are
one matrix product. Seam-LPIPS of a crop is the mean of its NEIGHBOURS smallest distances to a bank of crops of the
exemplar, without its trend, rendered in the same view. Crops that overlap the crop's own sources are left out.

It needs no reference, so it is defined where two patches meet. It is never 0. Its floor is the same distance of the
patches of the crop, each rendered alone and weighted where the crop shows it: how different places of the exemplar are.
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

NEIGHBOURS = 3  # chosen on brighton_beach, as the sizes of crops and bank
BATCH = 64  # crops whose features are in memory


Shapes = list[tuple[int, int, int]]  # channels, rows and columns of each layer


def embed_images(pictures: Float32[Array, "n h w 3"], weights: Weights) -> tuple[Float32[Array, "n d"], Shapes]:
    """Vectors whose squared distances are LPIPS, and the shapes of their layers. pictures: in [0, 1].

    Raises: as `lpips.layers`.
    """
    parts, shapes = [], []
    with one_thread():
        for start in range(0, len(pictures), BATCH):
            some = lpips.layers(2 * pictures[start : start + BATCH] - 1, weights)
            shapes = [layer.shape[1:] for layer in some]
            parts.append(np.concatenate([_flatten(f, h) for f, h in zip(some, weights.heads, strict=True)], 1))
    return np.concatenate(parts), shapes


def _flatten(features: Float32[Array, "n c h w"], head: Float32[Array, "c"]) -> Float32[Array, "n d"]:
    length = np.sqrt((features**2).sum(1, keepdims=True)) + np.float32(1e-10)
    pixels = features.shape[2] * features.shape[3]
    return (features / length * np.sqrt(head / pixels)[:, None, None]).reshape(len(features), -1)


def pool_masks(masks: Float32[Array, "k h w"], shapes: Shapes) -> Float32[Array, "k d"]:
    """Weight of each mask in every entry of a vector: the mask's mean over the entry's part of the picture."""
    pooled = []
    for channels, rows, columns in shapes:
        small = functional.adaptive_avg_pool2d(torch.from_numpy(masks)[:, None], (rows, columns)).numpy()
        pooled.append(np.repeat(small, channels, axis=1).reshape(len(masks), -1))
    return np.concatenate(pooled, 1)


def pairwise_distances(crops: Float32[Array, "n d"], bank: Float32[Array, "m d"]) -> Float64[Array, "n m"]:
    """LPIPS of every crop to every crop of the bank."""
    with one_thread(), torch.inference_mode():
        a, b = (torch.from_numpy(each).double() for each in (crops, bank))
        apart = (a * a).sum(1)[:, None] + (b * b).sum(1) - 2 * a @ b.T
        return apart.clamp(min=0).numpy()


def find_nearest(
    apart: Float64[Array, "n m"], allowed: Bool[Array, "m"], count: int = NEIGHBOURS
) -> Int[Array, "n count"]:
    """Indices of the nearest allowed crops of the bank. Raises: InputError: fewer than `count` are allowed."""
    if allowed.sum() < count:
        raise InputError(
            "seams: the exemplar has too few crops that do not overlap a crop's own sources; choose a smaller "
            "`tile` in the config's tilings, or take photos of a larger ground"
        )
    return np.argsort(np.where(allowed, apart, np.inf), axis=1, kind="stable")[:, :count]


def compute_floor(
    own: Float32[Array, "k d"], neighbours: list[Float32[Array, "count d"]], visible: Float32[Array, "k d"]
) -> float:
    """Mean distance of patches to their nearest crops, each weighted where the crop shows it.

    visible: `pool_masks` of the patches' masks, which sum to 1 everywhere.
    """
    parts = [
        float((((near - v).astype(float) ** 2).mean(0) * s).sum())
        for v, near, s in zip(own, neighbours, visible, strict=True)
    ]
    return sum(parts)


def exclude_overlaps(boxes: Int[Array, "k 2 2"], bank: Int[Array, "m 2 2"]) -> Bool[Array, "m"]:
    """Which crops of the bank overlap none of a crop's sources; boxes of exemplar cells, both ends included."""
    low, high = boxes[:, None, 0] <= bank[None, :, 1], boxes[:, None, 1] >= bank[None, :, 0]
    return np.logical_not((low & high).all(-1).any(0))
