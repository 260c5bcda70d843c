from itertools import product

import numpy as np
import pytest
from fixtures.seams import cost
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.tiles import energy, semantics
from dav_gswt_study import expansion
from dav_gswt_study.expansion import Patches

HALF = 0.5 * 2.0**-26  # what an edge's cost loses as a whole number


def exemplar(seed, side=14):
    rng = np.random.default_rng(seed)
    colour = rng.random((side, side, 3))
    segments = rng.integers(0, 9, (side, side))
    both = energy.make_colour_layer(colour), semantics.describe_segments(segments, colour, None)
    return energy.SeamEnergy("semantic", 2.0, *both).terms(0.6)


def place(seed, count, shape):
    """Patches from random places, allowed anywhere but on the rim."""
    places = np.random.default_rng(seed + 1).integers(0, 14 - max(shape) + 1, (count, 2))
    y, x = np.mgrid[: shape[0], : shape[1]]
    allowed = np.zeros((count, *shape), bool)
    allowed[:, 1:-1, 1:-1] = True
    return Patches(*(np.stack([grid + p for p in places[:, axis]]) for axis, grid in ((0, y), (1, x))), allowed)


@given(seed=st.integers(0, 2**32 - 2), count=st.integers(2, 5))
@settings(max_examples=25)
def test_the_energy_never_rises_and_is_that_of_the_labels(seed, count):
    terms, patches = exemplar(seed), place(seed, count, (6, 7))
    start = np.random.default_rng(seed).integers(0, count, (6, 7)).astype(np.uint8)
    found = expansion.expand_labels(start, patches, terms)
    assert (np.diff(found.energies) < 0).all()
    for labels, record in ((start, found.energies[0]), (found.labels, found.energies[-1])):
        assert record == pytest.approx(cost(terms, labels, patches.rows, patches.columns), abs=71 * HALF)
    assert 0 <= found.broken <= found.tested
    np.testing.assert_array_equal(found.labels[0], start[0])  # where nothing else is allowed
    assert len(expansion.expand_labels(found.labels, patches, terms).energies) == 1  # no move is left


def test_of_two_patches_it_is_as_cheap_as_the_best_of_all_labellings():
    terms, patches = exemplar(1), place(1, 2, (4, 5))
    start = np.random.default_rng(1).integers(0, 2, (4, 5)).astype(np.uint8)
    best = np.inf
    for bits in product([0, 1], repeat=6):
        labels = start.copy()
        labels[1:-1, 1:-1] = np.reshape(bits, (2, 3))
        best = min(best, cost(terms, labels, patches.rows, patches.columns))
    found = expansion.expand_labels(start, patches, terms)
    assert found.energies[-1] == pytest.approx(best, abs=31 * HALF) and found.broken == 0
