"""Painted places: points of the lattice of scores that a person gave a material.

A painted point counts for the points up to two steps around it with the binomial weights SPREAD, so what is painted
has a smooth border that crosses the lattice at about the steepness of a rule's, and the same jitter frays it. At a
point whose surroundings are painted with a weight, the rule keeps the rest; there its scores are taken from the highest
and cut, since a rule may have any lead.

The viewer computes the same scores; tests/golden/classes.json holds both to them.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int64
from numpy import ndarray as Array

from dav_gswt.bundle.land_cover import ClassesEntry

BLOCK = 8  # points along the side of a block of storage
SPREAD = np.array([1, 4, 6, 4, 1])  # weights along an axis, by which a painted point counts for those around it
WHOLE = 256  # sum of the products of two weights
REACH = 2  # steps of the lattice to the farthest of them
LEAD = 1.25  # of what is painted over all others, as a multiple of what border effects can change


def paint_lead(entry: ClassesEntry) -> float:
    """By how much the score of what is painted exceeds the others: just enough that nothing of them is left."""
    return LEAD * (2 * entry.jitter.amplitude + entry.rise.most) or 1.0


class Painted:
    """A sparse set of painted points.

    Args:   runs: [I, J, length, material], from (I, J) to the east.
    """

    def __init__(self, runs: Sequence[Sequence[int]]):
        self._blocks: dict[tuple[int, int], Int64[Array, "8 8"]] = {}  # -1: not painted
        for i, j, length, material in runs:
            for x in range(i, i + length):
                block = self._blocks.setdefault((x // BLOCK, j // BLOCK), np.full((BLOCK, BLOCK), -1))
                block[j % BLOCK, x % BLOCK] = material

    def __len__(self) -> int:
        return sum(int((block >= 0).sum()) for block in self._blocks.values())

    def weights_at(self, i: Int64[Array, "n"], j: Int64[Array, "n"], materials: int) -> Int64[Array, "n m"]:
        """Weights of the materials painted at and around points, in units of 1 / WHOLE."""
        weights = np.zeros((len(i), materials), np.int64)
        if not self._blocks:
            return weights
        keys = {(a + x, b + y) for a, b in self._blocks for x in (-1, 0, 1) for y in (-1, 0, 1)}
        a, b = i // BLOCK, j // BLOCK
        near = np.flatnonzero([cell in keys for cell in zip(a.tolist(), b.tolist(), strict=True)])
        for row in near.tolist():
            weights[row] = self._weights_of_point(int(i[row]), int(j[row]), materials)
        return weights

    def _weights_of_point(self, i: int, j: int, materials: int) -> list[int]:
        weights = [0] * materials
        for b in range((j - REACH) // BLOCK, (j + REACH) // BLOCK + 1):
            for a in range((i - REACH) // BLOCK, (i + REACH) // BLOCK + 1):
                if (block := self._blocks.get((a, b))) is None:
                    continue
                ys = np.arange(max(j - REACH, BLOCK * b), min(j + REACH, BLOCK * b + BLOCK - 1) + 1)
                xs = np.arange(max(i - REACH, BLOCK * a), min(i + REACH, BLOCK * a + BLOCK - 1) + 1)
                values = block[np.ix_(ys - BLOCK * b, xs - BLOCK * a)]
                spread = np.outer(SPREAD[ys - j + REACH], SPREAD[xs - i + REACH])
                for material in range(materials):
                    weights[material] += int(spread[values == material].sum())
        return weights


def apply_paint(scores: Float[Array, "n m"], weights: Int64[Array, "n m"], lead: float) -> Float[Array, "n m"]:
    """Scores at points with paint at or around some of them: what is painted has 0 and all others -lead with its
    weight, and the rule's scores, less the highest and cut at -lead, have the rest.

    All materials of a point may be lifted by the same amount without effect, so points without paint keep the rule's.
    """
    total = weights.sum(1, keepdims=True)
    rest = np.maximum(scores - scores.max(1, keepdims=True), -lead)
    mixed = ((WHOLE - total) * rest - lead * (total - weights)) / WHOLE
    return np.where(total > 0, mixed, scores)
