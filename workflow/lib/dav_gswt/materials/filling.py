"""Fill cells of an exemplar with patches of other cells: which cell each of them copies.

Square patches of the source are placed along the rim of the hole, where most is known around, and joined
to it along the cheapest seam (Kwatra et al. 2003, "Graphcut textures", in the order of Criminisi et al.
2004). A patch comes from the place that differs least from what is known, with a charge for ground that
other patches show already.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.tiles.energy import CostLayer, compute_edge_costs, find_cut
from dav_gswt.tiles.patches import box_sums, divide_by_median

CANDIDATES = 160  # places that are compared for a patch
COMPARED = 256  # cells of a patch that they are compared by
MIN_PLACES = 12  # of a patch: with fewer, patches are made smaller
MIN_PATCH = 4  # cells
REPEAT_COST = 0.5  # charge for ground that is shown once more, where a median place costs 1


@dataclass(frozen=True)
class CellSources:
    """For each cell of an exemplar, the cell that it shows. Cells that are not filled show themselves."""

    rows: Int[Array, "m m"]
    columns: Int[Array, "m m"]

    @property
    def copied(self) -> Bool[Array, "m m"]:
        """Cells that show another one."""
        rows, columns = np.mgrid[: len(self.rows), : len(self.rows)]
        return (rows != self.rows) | (columns != self.columns)


def fill_cells(
    features: Float[Array, "m m k"],
    terms: Sequence[tuple[float, CostLayer]],
    source: Bool[Array, "m m"],
    patch: int,
    rng: np.random.Generator,
) -> CellSources | None:
    """Fill all cells that are not in the source with patches of the source.

    Args:
        features: that places are compared by.
        terms: layers of the seam's cost with their weights (`SeamEnergy.terms`).
        source: cells that stay, and that patches are taken from.
        patch: side of a patch in cells; halved while the source has too few places for it.
    Returns: None where the source has no room for the smallest patch.
    """
    places = find_places(source, patch)
    while len(places) < MIN_PLACES and patch > MIN_PATCH:
        patch = max(MIN_PATCH, patch // 2)
        places = find_places(source, patch)
    if not len(places):
        return None
    state = _Filling(features, terms, source, places, patch, rng)
    while (corner := state.next_corner()) is not None:
        state.place_patch(*corner)
    return CellSources(state.rows, state.columns)


def find_places(source: Bool[Array, "m m"], patch: int) -> Int[Array, "n 2"]:
    """South-western cells (row, column) of all squares of `patch` cells that lie in the source."""
    if patch > len(source):
        return np.zeros((0, 2), int)
    return np.argwhere(box_sums(source, patch, patch) == patch * patch)


class _Filling:
    """A map that is being filled."""

    def __init__(self, features, terms, source, places, patch: int, rng: np.random.Generator):
        self.features, self.terms, self.places, self.patch, self.rng = features, terms, places, patch, rng
        self.rows, self.columns = np.mgrid[: len(source), : len(source)]
        self.known = source.copy()
        self.shown = np.zeros(source.shape)  # how often each cell has been copied
        last = len(source) - patch
        self.starts = np.unique(np.append(np.arange(0, last + 1, max(1, patch // 2)), last))
        self.counts = box_sums(source, patch, patch)[np.ix_(self.starts, self.starts)]  # known cells from each start

    def next_corner(self) -> tuple[int, int] | None:
        """Where the next patch goes: of the places on a grid that are not full, the one with most known cells."""
        counts = np.where(self.counts == self.patch**2, -1, self.counts)
        row, column = np.unravel_index(int(counts.argmax()), counts.shape)
        return None if counts.max() < 0 else (int(self.starts[row]), int(self.starts[column]))

    def place_patch(self, row: int, column: int) -> None:
        """Choose a patch for a place, cut it against what is known there, and copy it."""
        p = self.patch
        window = np.s_[row : row + p, column : column + p]
        known = self.known[window]
        here = self.rows[window], self.columns[window]
        y, x = self._choose_place(known, here)
        there = tuple(np.mgrid[y : y + p, x : x + p])
        new = self._cut_patch(known, here, (there[0], there[1]))
        self.rows[window] = np.where(new, there[0], here[0])
        self.columns[window] = np.where(new, there[1], here[1])
        self.shown[y : y + p, x : x + p] += new
        self.known[window] = True
        near = [np.flatnonzero(np.abs(self.starts - at) < p) for at in (row, column)]
        for i in near[0]:
            for j in near[1]:
                r, c = self.starts[i], self.starts[j]
                self.counts[i, j] = self.known[r : r + p, c : c + p].sum()

    def _choose_place(self, known: Bool[Array, "p p"], here: tuple[Array, Array]) -> tuple[int, int]:
        drawn = self.rng.integers(len(self.places), size=min(CANDIDATES, len(self.places)))
        drawn = self.places[np.unique(drawn)]
        y, x = np.nonzero(known)
        if len(y) > COMPARED:
            pick = self.rng.choice(len(y), COMPARED, replace=False)
            y, x = y[pick], x[pick]
        wanted = self.features[here[0][y, x], here[1][y, x]]
        found = self.features[drawn[:, :1] + y, drawn[:, 1:] + x]
        cost = divide_by_median(((found - wanted) ** 2).sum(-1).mean(-1)) if len(y) else np.zeros(len(drawn))
        inside = np.arange(self.patch)
        often = self.shown[drawn[:, :1, None] + inside[:, None], drawn[:, 1:, None] + inside].mean((1, 2))
        best = drawn[int(np.argmin(cost + REPEAT_COST * often))]
        return int(best[0]), int(best[1])

    def _cut_patch(self, known: Array, here: tuple[Array, Array], there: tuple[Array, Array]) -> Bool[Array, "p p"]:
        """Which cells show the new patch: all that are not known, and beyond the cheapest seam through those that are.

        Known cells on the rim stay, so no seam leaves the patch.
        """
        rim = np.ones_like(known)
        rim[1:-1, 1:-1] = False
        keep = known & rim
        if not keep.any():
            return ~known if known.any() else np.ones_like(known)
        return find_cut(*compute_edge_costs(self.terms, here, there), keep, ~known).labels
