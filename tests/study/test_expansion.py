"""Alpha-expansion against all labellings of small grids; its energy never rises."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from fixtures import tile_sets
from fixtures.seams import cost
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.study import expansion
from dav_gswt.study.expansion import Patches
from dav_gswt.tiles import build, energy, layout, semantics
from dav_gswt.tiles.layout import NE, NW, SE, SW, E, Layout, N, PatchPlaces, S, W

HALF = 0.5 * 2.0**-26  # what an edge's cost loses as a whole number


def exemplar(seed, side=14):
    rng = np.random.default_rng(seed)
    colour = rng.random((side, side, 3))
    segments = rng.integers(0, 9, (side, side))
    both = energy.make_colour_layer(colour), semantics.describe_segments(segments, colour, None, {})
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
    again = expansion.expand_labels(found.labels, patches, terms)
    assert len(again.energies) == 1  # no move is left


@pytest.mark.parametrize("seed", range(4))
def test_of_two_patches_it_is_as_cheap_as_the_best_of_all_labellings(seed):
    terms, patches = exemplar(seed), place(seed, 2, (4, 5))
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


@pytest.mark.parametrize("axis", [0, 1])
def test_single_edges_cost_what_they_cost_in_a_grid(axis):
    terms = exemplar(5)
    pair = [tuple(np.mgrid[y : y + 4, x : x + 4]) for x, y in ((0, 0), (7, 4))]
    grid = energy.compute_edge_costs(terms, *pair)[axis]
    tails = tuple(np.indices(grid.shape).reshape(2, -1))
    heads = tails[0] + axis, tails[1] + 1 - axis
    ends = [tuple((rows[cells], columns[cells]) for rows, columns in pair) for cells in (tails, heads)]
    found = expansion.compute_costs_along(terms, *ends, np.full(grid.size, axis))
    np.testing.assert_allclose(found.reshape(grid.shape), grid, rtol=1e-12)


@pytest.fixture(scope="module")
def tile_sets_cut():
    """Tiles cut exactly, and expanded from there."""
    made, options = tile_sets.exemplar(), build.TilingOptions(share=0.5, strip=0.17, candidates=20, tries=1)
    records = []

    def cut(options):
        maps = made.colour, np.zeros((96, 96))
        return build.cut_tiles(made.levels, made.exemplar, *maps, options, np.random.default_rng(2))

    expanded = cut(replace(options, relabel=expansion.make_relabel(records)))
    return cut(options), expansion.add_records(expanded, records)


def test_expansion_starts_at_the_exact_cuts_and_never_costs_more(tile_sets_cut):
    exact, moved = tile_sets_cut
    assert exact.report.places == moved.report.places
    assert exact.report.tile_energy == moved.report.tile_energy
    for record in moved.report.more["expansion"]:
        assert record["after"] <= record["before"] and 0 <= record["triangles_broken"] <= record["triangles_tested"]
        assert (record["moves"] > 0) == (record["after"] < record["before"])
    assert any(record["moves"] for record in moved.report.more["expansion"])
    block = 4
    np.testing.assert_array_equal(exact.labels[:, :block], moved.labels[:, :block])
    np.testing.assert_array_equal(exact.labels[:, :, -block:], moved.labels[:, :, -block:])


def test_after_an_expansion_every_patch_lies_within_its_reach(tile_sets_cut):
    reach = expansion.allowed_cells(layout.plan_layout(96, 3, 0.5, 0.17))
    for labels in tile_sets_cut[1].labels:
        for label in range(9):
            assert not (labels[4:-4, 4:-4] == label)[~reach[label][4:-4, 4:-4]].any()


PLAN = Layout(exemplar=40, levels=1, side=10, strip=2, corner=3)
PLACES = PatchPlaces(
    np.array([30, 20]),
    np.array([[0, 1], [5, 2]]),
    np.array([[3, 30], [4, 25]]),
    np.tile([11, 12], (16, 1)),
)


def test_every_cell_may_show_some_patch_but_for_the_rim_and_only_where_it_reaches():
    reach = expansion.allowed_cells(PLAN)
    n, k = PLAN.side, PLAN.block
    inner = np.zeros((n, n), bool)
    inner[k : n - k, k : n - k] = True
    np.testing.assert_array_equal(reach[layout.CENTRE], inner)
    assert not reach[:, ~inner].any()
    y, x = np.nonzero(reach[W])
    assert set(x) == {1} and set(y) == set(range(2, 8))  # a strip is 2 wide; the rim is 1
    np.testing.assert_array_equal(reach[S], reach[W].T)
    np.testing.assert_array_equal(reach[E], reach[W][:, ::-1])
    np.testing.assert_array_equal(reach[N], reach[S][::-1])
    np.testing.assert_array_equal(np.argwhere(reach[SW]), [[1, 1], [1, 2], [2, 1], [2, 2]])  # a corner is 3
    np.testing.assert_array_equal(reach[NE], reach[SW][::-1, ::-1])
    np.testing.assert_array_equal(reach[SE], reach[SW][:, ::-1])
    np.testing.assert_array_equal(reach[NW], reach[SW][::-1])


def test_what_reaches_a_cell_lies_in_the_exemplar():
    shift = layout.label_shifts(PLAN, PLACES, 5)
    for label, cells in enumerate(expansion.allowed_cells(PLAN)):
        y, x = np.nonzero(cells)
        assert ((shift[label] + np.stack([x, y], 1)) >= 0).all()
        assert ((shift[label] + np.stack([x, y], 1)) < PLAN.exemplar).all()
