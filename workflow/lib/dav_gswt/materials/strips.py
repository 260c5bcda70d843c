"""Strips: long ground of constant width that differs from both its sides, as a path, a road or a ditch.

Tiles cannot show one: it would begin and end in nothing. Its cells are left out of the materials beside it.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import binary_closing, binary_dilation, binary_opening, distance_transform_edt, label

LEAST_LENGTH, LEAST_WIDTH = 0.8, 0.03  # of the exemplar's side
MARGIN = 2  # cells that a strip is widened by: the opening takes one, and cells on its border are of no cluster
WIDEST = 0.13  # of the side: wider ground has room for patches
WIDEST_CLOSED = 0.2  # the same of a strip with its gaps closed: a net, as between stones, fills a wide field
MOST_VARIATION = 0.32  # standard deviation of the width over its mean
LEAST_SHARE = 0.5  # of the cells that look like it, that lie in the strip
LEAST_PIECE = 0.1  # of the cells that look like it, of a piece of a strip that something lies across
FORK_LENGTH, FORK_VARIATION, FORK_SHARE = 1.5, 0.5, 0.9  # the same of strips that fork: they are wider there
LEAST_DIFFERENCE = 5.5  # weighed CIELAB units between a strip and what is beside it
SIDE = 0.25  # of what is beside a strip, that a class has at least if it lies on a side of it
BESIDE = 0.06  # of the side: so near to a strip its blurred rim may look like another
MOST_OVERLAP = 0.1  # of a second strip with the first one and what is beside it


def find_strips(clusterings: Sequence[Int[Array, "k k"]]) -> list[Bool[Array, "k k"]]:
    """Strips among the clusters of any of these clusterings, those first that most of their cluster belongs to."""
    clusters = {}  # each once: a merger changes one cluster and leaves the others
    for labels in clusterings:
        for number in range(int(labels.max()) + 1):
            cluster = labels == number
            clusters[np.packbits(cluster).tobytes()] = cluster
    candidates = [each for cluster in clusters.values() for each in _measure_strip(cluster)]
    found: list[Bool[Array, "k k"]] = []
    for _, cells in sorted(candidates, key=lambda each: -each[0]):
        reach = max(1, round(BESIDE * len(cells)))
        if all(
            (cells & binary_dilation(other, iterations=reach)).sum() <= MOST_OVERLAP * cells.sum() for other in found
        ):
            found.append(cells)
    return found


def is_transition(strip: Bool[Array, "k k"], colours: Float[Array, "k k c"], labels: Int[Array, "k k"]) -> bool:
    """Whether a strip's colour is that beside it, or a mixture of what lies on its two sides, as on a border.

    Colours are medians, which a few things on the ground do not change. colours: weighed CIELAB. labels: classes of
    the ground.
    """
    ring = binary_dilation(strip, iterations=max(2, round(BESIDE * len(strip)))) & ~strip
    count = np.bincount(labels[ring])
    sides = [np.median(colours[ring & (labels == k)], 0) for k in np.flatnonzero(count >= SIDE * ring.sum())]
    own = np.median(colours[strip], 0)
    return any(_measure_distance(own, one, two) < LEAST_DIFFERENCE for one in sides for two in sides)


def _measure_distance(point: Float[Array, "c"], one: Float[Array, "c"], two: Float[Array, "c"]) -> float:
    """From a point to the line between two others."""
    way = two - one
    t = float(np.clip((point - one) @ way / max(float(way @ way), 1e-12), 0, 1))
    return float(np.linalg.norm(point - one - t * way))


def _measure_strip(cluster: Bool[Array, "k k"]) -> list[tuple[float, Bool[Array, "k k"]]]:
    """The larger pieces of a cluster, if together they are a strip that something lies across; else the largest, if it
    is one. With its share of the cluster."""
    own = binary_opening(cluster, np.ones((3, 3), bool))
    pieces, number = label(own)
    if not number:
        return []
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    largest = pieces == sizes.argmax()
    together = np.isin(pieces, np.flatnonzero(sizes >= LEAST_PIECE * own.sum()))
    for piece in (together, largest):
        share = float(piece.sum() / own.sum())
        if _is_strip(piece, share):
            return [(share, binary_dilation(piece, iterations=MARGIN))]
    return []


def _is_strip(piece: Bool[Array, "k k"], share: float) -> bool:
    """Whether cells are long and of constant width. share: of their cluster."""
    from skimage.morphology import skeletonize  # here, not above: it takes half a second to load

    k = len(piece)
    if share < LEAST_SHARE or piece.sum() < LEAST_LENGTH * LEAST_WIDTH * k * k:
        return False
    line = skeletonize(piece)
    inner = distance_transform_edt(np.pad(piece, 1))[1:-1, 1:-1]
    widths = 2 * inner[line]
    length, width = line.sum() / k, widths.mean() / k
    variation = widths.std() / widths.mean()
    straight = length >= LEAST_LENGTH and variation <= MOST_VARIATION
    forked = length >= FORK_LENGTH and variation <= FORK_VARIATION and share >= FORK_SHARE
    if not (straight or forked) or width < LEAST_WIDTH or 2 * float(inner.max()) > WIDEST * k:
        return False
    closed = binary_closing(np.pad(piece, k), iterations=1 + round(width * k))
    one = label(closed)[1] == 1  # pieces that are farther apart than a strip is wide are not parts of one
    return one and 2 * float(distance_transform_edt(closed).max()) <= WIDEST_CLOSED * k
