"""Segmentation of an exemplar into classes of ground that differ in colour or grain.

Cells are clustered by their soft colour (CIELAB at a normalized exposure) and the contrast of their
grain. Clusters are merged (Ward 1963) while two of them look alike: their means hardly differ, their
distributions overlap, or their border is a gradual change, as between light and shade. Labels are
smoothed by graph cuts (alpha expansion, Boykov et al. 2001).
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.cluster.vq import kmeans2
from scipy.ndimage import gaussian_filter

from dav_gswt.materials import strips

logging.getLogger("maxflow.fastmin").setLevel(logging.WARNING)  # it logs every cut

CLUSTERS = 12  # before merging
STARTS = 5  # of k-means
WORKING_SIZE = 256  # cells along a side that are clustered; larger exemplars are averaged
BRIGHTEST, QUANTILE = 0.9, 0.95  # exposure: this quantile of the brightest channel becomes so bright
HIGHLIGHT = 1.7  # times the median, that this quantile counts as at most: a few white stones are no measure of all
SOFT, GRAIN = 1 / 150, 1 / 30  # of the side: blur of colours, window of the grain's contrast
WEIGHTS = (0.5, 1.0, 1.0, 1.5)  # of lightness (shade changes it), a, b, contrast
LEAST_DIFFERENCE = 13.0  # of two classes' means, in weighed CIELAB units: 2.3 is just noticeable between flat patches
LEAST_WITH_GRAIN = 10.0  # the same for classes of other grain: light does not change it
OTHER_GRAIN = 4.0  # difference of contrasts from which grain is another
LEAST_SEPARATION = 2.4  # of their distributions (Ashman's D: beyond 2 they are two)
LEAST_SHARPNESS = 0.35  # of their border: the step across it over the difference of the means
REACH = 1 / 25  # of the side, either way, over which that step is measured: wider than the blur of the grain's contrast
SMOOTHING = 3.0  # cost of a border between two cells, in units of log likelihood
UNLIKELY = 20.0  # largest cost of a label


@dataclass(frozen=True)
class Difference:
    """How unlike two classes are. cost: Ward's, of merging them."""

    first: int
    second: int
    is_small: bool
    is_gradual: bool
    cost: float


Segmentation = tuple[Int[Array, "m m"], list[Bool[Array, "m m"]]]


def list_segmentations(colour: Float[Array, "m m 3"]) -> Iterator[Segmentation]:
    """Segmentations from every start of k-means, the one that explains most of the variance first.

    Each: classes of the exemplar by descending share, from 0, and the strips that cross it. Strips may be of any
    class: they are found in clusters before these are merged, from every start, since few starts happen to set a strip
    apart. colour: sRGB in [0, 1].
    """
    features = describe_cells(_shrink(colour))
    traces = [merge_clusters(features, _cluster(features, start)) for start in range(STARTS)]
    candidates = strips.find_strips([clusters for each in traces for clusters in each])
    for trace in sorted(traces, key=lambda trace: -_explained_variance(features, trace[-1])):
        labels = smooth_labels(features, trace[-1])
        found = [each for each in candidates if not strips.is_transition(each, features[..., :3], labels)]
        labels, crossing = _enlarge(labels, len(colour)), [_enlarge(each, len(colour)) for each in found]
        order = np.argsort(-np.bincount(labels.ravel()), kind="stable")
        yield np.argsort(order)[labels], crossing


def describe_cells(colour: Float[Array, "m m 3"]) -> Float[Array, "m m 4"]:
    """Weighed lightness, a, b, and the contrast of the grain around each cell."""
    from skimage.color import rgb2lab  # here, not above: it takes half a second to load

    m = len(colour)
    median, bright = np.quantile(colour.max(-1), [0.5, QUANTILE])
    bright = min(float(bright), HIGHLIGHT * float(median))
    lab = rgb2lab(np.clip(colour * (BRIGHTEST / max(bright, 1e-3)), 0, 1))
    soft = np.stack([gaussian_filter(lab[..., c], SOFT * m, mode="nearest") for c in range(3)], -1)
    grain = lab[..., 0] - gaussian_filter(lab[..., 0], GRAIN * m / 2, mode="nearest")
    contrast = np.sqrt(gaussian_filter(grain**2, GRAIN * m, mode="nearest"))
    return np.concatenate([soft, contrast[..., None]], -1) * WEIGHTS


def _cluster(features: Float[Array, "m m k"], start: int) -> Int[Array, "m m"]:
    cells = features.reshape(-1, features.shape[-1])
    if not np.ptp(cells, axis=0).any():
        return np.zeros(features.shape[:2], int)
    centres, _ = kmeans2(cells[::2], CLUSTERS, iter=30, minit="++", rng=start, missing="warn")
    distances = np.stack([((features - centre) ** 2).sum(-1) for centre in centres])
    return np.unique(distances.argmin(0), return_inverse=True)[1].reshape(features.shape[:2])


def _explained_variance(features: Float[Array, "m m k"], labels: Int[Array, "m m"]) -> float:
    """Variance between the classes, as a part of all."""
    total = features.reshape(-1, features.shape[-1]).var(0).sum()
    means = np.stack([features[labels == c].mean(0) for c in range(labels.max() + 1)])
    share = np.bincount(labels.ravel()) / labels.size
    away = means - share @ means
    return float((share @ away**2).sum() / max(total, 1e-12))


def merge_clusters(features: Float[Array, "m m k"], labels: Int[Array, "m m"]) -> list[Int[Array, "m m"]]:
    """Merge what looks alike: first classes of a small difference, then those of a gradual one, the cheapest first.

    Returns: the labels before the first merger, after it, and so on.
    """
    kept, trace = list(range(int(labels.max()) + 1)), [labels]
    found = {(a, b): compare_classes(features, labels, a, b) for a, b in combinations(kept, 2)}
    while True:
        pairs = [found[pair] for pair in sorted(found)]
        alike = [each for each in pairs if each.is_small] or [each for each in pairs if each.is_gradual]
        if not alike:
            return trace
        best = min(alike, key=lambda each: each.cost)
        labels = np.where(labels == best.second, best.first, labels)
        kept.remove(best.second)
        found = {pair: each for pair, each in found.items() if not {best.first, best.second} & {*pair}}
        for pair in combinations(kept, 2):
            if best.first in pair:
                found[pair] = compare_classes(features, labels, *pair)
        trace.append(np.searchsorted(kept, labels))


def compare_classes(features: Float[Array, "m m k"], labels: Int[Array, "m m"], first: int, second: int) -> Difference:
    """How unlike two classes are, along the line between their means."""
    one, two = labels == first, labels == second
    step = features[two].mean(0) - features[one].mean(0)
    distance = float(np.linalg.norm(step))
    along = features @ (step / max(distance, 1e-12))
    spread = float(np.sqrt(0.5 * (along[one].var() + along[two].var())))
    share = one.mean() * two.mean() / (one.mean() + two.mean())
    sharpness = _measure_border(along, one, two) / max(distance, 1e-12)
    grain, separation = float(abs(step[-1]) / WEIGHTS[-1]), distance / max(spread, 1e-12)
    is_small = distance < (LEAST_DIFFERENCE if grain < OTHER_GRAIN else LEAST_WITH_GRAIN)
    is_gradual = separation < LEAST_SEPARATION or sharpness < LEAST_SHARPNESS
    return Difference(first, second, is_small, is_gradual, distance**2 * share)


def _measure_border(along: Float[Array, "m m"], one: Array, two: Array) -> float:
    """Median step across the border of two classes; infinite where they hardly touch."""
    m = len(along)
    reach = max(2, round(REACH * m))
    steps = []
    for values, a, b in ((along, one, two), (along.T, one.T, two.T)):
        rise = values[2 * reach :] - values[: m - 2 * reach]
        steps += [rise[a[: m - 2 * reach] & b[2 * reach :]], -rise[b[: m - 2 * reach] & a[2 * reach :]]]
    every = np.concatenate(steps)
    return float(np.median(every)) if len(every) > 2 * reach else float("inf")


def smooth_labels(features: Float[Array, "m m k"], labels: Int[Array, "m m"]) -> Int[Array, "m m"]:
    """Labels of the least cost: minus the log likelihood of each class's normal distribution, and borders."""
    from maxflow import fastmin

    number = int(labels.max()) + 1
    if number == 1:
        return labels
    costs = np.stack([_negative_log_likelihood(features, features[labels == c]) for c in range(number)], -1)
    costs = np.minimum(costs - costs.min(-1, keepdims=True), UNLIKELY)
    smoothed = fastmin.aexpansion_grid(costs, SMOOTHING * (1 - np.eye(number)), labels=labels.astype(np.int64))
    return np.unique(smoothed, return_inverse=True)[1].reshape(labels.shape)


def _negative_log_likelihood(features: Float[Array, "m m k"], members: Float[Array, "n k"]) -> Float[Array, "m m"]:
    spread = np.cov(members.T) if len(members) > 1 else 0.0
    covariance = spread + np.eye(members.shape[1])  # a just noticeable difference of each
    away = features - members.mean(0)
    square = np.einsum("...i,ij,...j->...", away, np.linalg.inv(covariance), away)
    return 0.5 * (square + np.linalg.slogdet(covariance)[1])


def _shrink(colour: Float[Array, "m m 3"]) -> Float[Array, "k k 3"]:
    """Blocks of cells averaged, so that at most WORKING_SIZE are left along a side."""
    block = -(-len(colour) // WORKING_SIZE)
    k = len(colour) // block
    return colour[: k * block, : k * block].reshape(k, block, k, block, 3).mean((1, 3))


def _enlarge(labels: Array, cells: int) -> Array:
    index = np.minimum(np.arange(cells) // -(-cells // WORKING_SIZE), len(labels) - 1)
    return labels[np.ix_(index, index)]
