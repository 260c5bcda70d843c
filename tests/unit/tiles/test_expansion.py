"""Alpha-expansion against all labellings of small grids; its energy never rises."""

from itertools import product

import numpy as np
import pytest
from fixtures.seams import cost
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.tiles import energy, expansion, semantics
from dav_gswt.tiles.expansion import Patches

HALF = 0.5 * 2.0**-26  # what an edge's cost loses as a whole number


def exemplar(seed, side=14):
    rng = np.random.default_rng(seed)
    colour = rng.random((side, side, 3))
    segments = rng.integers(0, 9, (side, side))
    both = energy.make_colour_layer(colour), semantics.describe_segments(segments, colour, None, {})
    return energy.SeamEnergy("expansion", 2.0, *both).terms(0.6)


def laid(seed, count, shape):
    """Patches from random places, allowed anywhere but on the rim."""
    places = np.random.default_rng(seed + 1).integers(0, 14 - max(shape) + 1, (count, 2))
    y, x = np.mgrid[: shape[0], : shape[1]]
    allowed = np.zeros((count, *shape), bool)
    allowed[:, 1:-1, 1:-1] = True
    return Patches(*(np.stack([grid + p for p in places[:, axis]]) for axis, grid in ((0, y), (1, x))), allowed)


@given(seed=st.integers(0, 2**32 - 2), count=st.integers(2, 5))
@settings(max_examples=25)
def test_the_energy_never_rises_and_is_that_of_the_labels(seed, count):
    terms, patches = exemplar(seed), laid(seed, count, (6, 7))
    start = np.random.default_rng(seed).integers(0, count, (6, 7)).astype(np.uint8)
    found = expansion.expand_labels(start, patches, terms)
    assert (np.diff(found.energies) < 0).all()
    for labels, told in ((start, found.energies[0]), (found.labels, found.energies[-1])):
        assert told == pytest.approx(cost(terms, labels, patches.rows, patches.columns), abs=71 * HALF)
    assert 0 <= found.broken <= found.tested
    np.testing.assert_array_equal(found.labels[0], start[0])  # where nothing else is allowed
    again = expansion.expand_labels(found.labels, patches, terms)
    assert len(again.energies) == 1  # no move is left


@pytest.mark.parametrize("seed", range(4))
def test_of_two_patches_it_is_as_cheap_as_the_best_of_all_labellings(seed):
    terms, patches = exemplar(seed), laid(seed, 2, (4, 5))
    start = np.random.default_rng(seed).integers(0, 2, (4, 5)).astype(np.uint8)
    best = np.inf
    for bits in product([0, 1], repeat=6):
        labels = start.copy()
        labels[1:-1, 1:-1] = np.reshape(bits, (2, 3))
        best = min(best, cost(terms, labels, patches.rows, patches.columns))
    found = expansion.expand_labels(start, patches, terms)
    assert found.energies[-1] == pytest.approx(best, abs=31 * HALF) and found.broken == 0


class Apart:
    """A made-up layer of one cell a patch: the distances between them, and no gradients."""

    def __init__(self, distance):
        self.distance, n = np.array(distance, float), len(distance)
        self.slope, self.unit = np.zeros((1, n, 2)), energy.LayerScales(2.0, 1.0)

    def distances(self, first, second):
        return self.distance[first[1], second[1]]


def row(labels, allowed):
    """Patches over one row of cells; each shows its own cell of the exemplar everywhere."""
    n = len(allowed)
    columns = np.broadcast_to(np.arange(n)[:, None, None], (n, 1, len(labels)))
    return np.array([labels], np.uint8), Patches(np.zeros_like(columns), columns, np.array(allowed, bool)[:, None])


def test_edges_that_break_the_triangle_are_counted_and_do_no_harm():
    # from 0 to 1 costs 10, over 2 it costs 1 + 1
    terms = [(1.0, Apart([[0, 10, 1], [10, 0, 1], [1, 1, 0]]))]
    labels, patches = row([0, 0, 1, 1], [[0] * 4, [0] * 4, [0, 1, 1, 0]])
    found = expansion.expand_labels(labels, patches, terms)
    np.testing.assert_array_equal(found.labels, [[0, 2, 2, 1]])
    assert found.energies == [10.0, 2.0] and (found.broken, found.tested) == (1, 1)


def test_one_patch_alone_stays():
    labels, patches = row([0, 0, 0], [[1, 1, 1]])
    found = expansion.expand_labels(labels, patches, [(1.0, Apart([[0]]))])
    assert (found.labels == 0).all() and found.describe()["moves"] == 0 and found.energies == [0.0]


def test_identical_patches_cost_nothing():
    labels, patches = row([0, 1, 0, 1], [[1] * 4, [1] * 4])
    found = expansion.expand_labels(labels, patches, [(1.0, Apart([[0, 0], [0, 0]]))])
    assert found.energies == [0.0] and found.broken == 0
