"""Seams: their costs by hand, cheapest cuts against all partitions of small grids, and what stands on the ground."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.seams import cheapest
from fixtures.tile_sets import splats
from hypothesis import given, settings
from hypothesis import strategies as st

from dav_gswt.tiles import compose, energy, semantics
from dav_gswt.tiles.energy import ColourLayer, LayerScales
from dav_gswt.tiles.layout import Exemplar

UNIT = LayerScales(1.0, 1.0)
SHARES = st.sampled_from([0.0, 0.25, 0.5, 0.731, 1.0])
EXEMPLAR = Exemplar(-1.0, 2.0, 0.5, 4)
GROUND = [-0.1, 3.9, 0.0, 0.1, 0.9]


def where(x, y, h=4, w=4):
    rows, columns = np.mgrid[y : y + h, x : x + w]
    return rows, columns


def patches(*values):
    """Colours of an exemplar that shows patches side by side, gradients of each for itself; and where they lie."""
    h, w = values[0].shape[:2]
    slope = np.concatenate([energy.compute_gradients(v) for v in values], 1)
    layer = ColourLayer(slope, UNIT, np.concatenate(values, 1))
    return layer, [where(i * w, 0, h, w) for i in range(len(values))]


def noise_exemplar(seed, kind="semantic", side=12):
    """An exemplar of noise, in segments of 3 x 3 cells."""
    rng = np.random.default_rng(seed)
    colour = rng.random((side, side, 3))
    segments = np.kron(np.arange((side // 3) ** 2).reshape(side // 3, -1), np.ones((3, 3), int))
    layers = energy.make_colour_layer(colour), semantics.describe_segments(segments, colour, None)
    return energy.SeamEnergy(kind, 2.0, *layers)


def test_a_gradient_across_an_edge_makes_only_that_edge_cheaper():
    ramp = np.broadcast_to(np.arange(3.0)[None, :, None], (3, 3, 1))
    layer, (a, b) = patches(ramp, ramp + 0.1)
    right, upper = energy.compute_edge_costs([(1.0, layer)], a, b)
    # four gradients of 1 along x, none along y
    np.testing.assert_allclose(right, 0.2 / (4 + energy.EPS), rtol=1e-12)
    np.testing.assert_allclose(upper, 0.2 / energy.EPS, rtol=1e-12)


@given(seed=st.integers(0, 2**32 - 1), share=SHARES, place=st.tuples(*[st.integers(0, 8)] * 4))
@settings(max_examples=20)
def test_weights_are_symmetric_finite_not_negative_and_0_for_the_same_patch(seed, share, place):
    terms, (x, y, u, v) = noise_exemplar(seed).terms(share), place
    there, back = (
        energy.compute_edge_costs(terms, *p) for p in ((where(x, y), where(u, v)), (where(u, v), where(x, y)))
    )
    for a, b in zip(there, back, strict=True):
        np.testing.assert_array_equal(a, b)
        assert np.isfinite(a).all() and (a >= 0).all()
    for same in energy.compute_edge_costs(terms, where(x, y), where(x, y)):
        assert (same == 0).all()


def test_gamma_1_ignores_semantics_and_gamma_0_ignores_colour():
    one, other = noise_exemplar(0), noise_exemplar(1)
    mixed = energy.SeamEnergy("semantic", 2.0, one.colours, other.semantics)
    pair = where(0, 0, 6, 6), where(5, 3, 6, 6)
    for share, like, unlike in ((1.0, one, other), (0.0, other, one)):
        found, same, another = (energy.compute_edge_costs(e.terms(share), *pair)[0] for e in (mixed, like, unlike))
        np.testing.assert_array_equal(found, same)
        assert (found != another).any()


def test_the_surer_a_patch_the_more_its_colours_count():
    mixed = noise_exemplar(1)
    assert mixed.gamma(0.5) == 0.5 and mixed.gamma(0.0) == pytest.approx(0.7310585786)  # 1 / (1 + exp(-1))
    assert mixed.gamma(0.0) + mixed.gamma(1.0) == pytest.approx(1)
    assert noise_exemplar(1, "semantic-nogamma").gamma(0.0) == 0.5
    colour = energy.SeamEnergy("colour", 2.0, mixed.colours, None)
    assert colour.gamma(0.9) == 1 and colour.terms(1.0) == [(1.0, colour.colours)]
    with pytest.raises(ValueError, match="not a number"):
        mixed.gamma(float("nan"))


@pytest.mark.parametrize("seed", range(4))
def test_cut_of_a_small_grid_is_as_cheap_as_the_best_of_all_partitions(seed):
    rng = np.random.default_rng(seed)
    right, upper = rng.random((4, 3)), rng.random((3, 4))
    first, second = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    first[:, 0], second[:, -1] = True, True
    if seed % 2:  # forced cells of any shape
        first[:, 0], first[1, 1], second[2, 1] = rng.random(4) < 0.5, True, True
    found = energy.find_cut(right, upper, first, second)
    # capacities are rounded to 2^-32 of the largest: 24 edges lose at most 24 halves of that
    assert found.energy == pytest.approx(cheapest(right, upper, first, second), abs=24 * 2.0**-32)
    assert not found.labels[first].any() and found.labels[second].all()


def test_a_straight_seam_costs_what_it_crosses_and_no_less_than_the_cut():
    rng = np.random.default_rng(3)
    right, upper = rng.random((5, 5)), rng.random((4, 6))
    half = np.arange(6) >= 3
    labels = np.broadcast_to(half, (5, 6))
    straight = energy.find_cut(right, upper, ~labels, labels)
    assert straight.energy == pytest.approx(right[:, 2].sum(), abs=5 * 2.0**-32)
    first, second = np.zeros((5, 6), bool), np.zeros((5, 6), bool)
    first[:, 0], second[:, -1] = True, True
    assert energy.find_cut(right, upper, first, second).energy < straight.energy


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_costs_that_mean_nothing_and_cells_forced_both_ways_are_refused(bad):
    costs, none, every = (np.array([[bad]]), np.zeros((0, 2))), np.zeros((1, 2), bool), np.ones((2, 2), bool)
    with pytest.raises(ValueError, match="finite"):
        energy.find_cut(*costs, none, none)
    with pytest.raises(ValueError, match="both"):
        energy.find_cut(np.ones((2, 1)), np.ones((1, 2)), every, every)


def a_field(*rows):
    """Gaussians of (x, y, z, standard deviation, opacity), round; the first one is ground."""
    x, y, z, size, opacity = np.array([GROUND, *rows], float).T
    field = splats(np.stack([x, y, z], 1), np.full((len(x), 3), 0.5), size[:, None], False)
    logits = np.log(opacity / (1 - opacity)).astype(np.float32)
    return replace(field, opacity_logits=logits, ground=np.arange(len(x)) == 0)


def test_cover_is_the_opaque_area_over_a_cell():
    # over cells (0, 0) and (2, 1), far up or just over half a cell
    field = a_field([-0.9, 2.1, 9.0, 0.05, 0.8], [0.2, 2.6, 0.26, 0.1, 0.5], [0.2, 2.6, 0.26, 0.1, 0.5])
    found = compose.compute_cover(field, EXEMPLAR, np.zeros((4, 4)))
    expected = np.zeros((4, 4))
    expected[0, 0] = 0.8 * 2 * np.pi * 0.05**2 / 0.25
    expected[1, 2] = 2 * 0.5 * 2 * np.pi * 0.1**2 / 0.25
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_cover_is_at_most_one_and_nothing_stands_on_ground_that_is_not_known():
    field = a_field([-0.9, 2.1, 5.0, 9.0, 0.99], [-0.4, 2.1, 5.0, 9.0, 0.99])
    height = np.zeros((4, 4))
    height[0, 1] = np.nan
    found = compose.compute_cover(field, EXEMPLAR, height)
    assert found[0, 0] == 1 and found.sum() == 1


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_parting_a_thing_costs_what_it_hides_whatever_gamma_is(share):
    cover = np.zeros((2, 4))
    cover[:, 1] = 0.75
    flat = energy.make_colour_layer(np.full((2, 4, 3), 0.5))
    priced = energy.SeamEnergy("semantic", 2.0, flat, flat, energy.make_occluder_layer(cover))
    rows, columns = np.mgrid[:2, :2]
    right, upper = energy.compute_edge_costs(priced.terms(share), (rows, columns), (rows, columns + 2))
    # of the four things in an edge's two cells one hides .75, and two do along the second column
    np.testing.assert_allclose(right, energy.OCCLUDER_WEIGHT * 0.75 / energy.EPS)
    np.testing.assert_allclose(upper, np.array([[0, energy.OCCLUDER_WEIGHT * 1.5]]) / energy.EPS)
    same = energy.compute_edge_costs(priced.terms(share), (rows, columns), (rows, columns))
    assert not any(w.any() for w in same)  # a shrub that goes on in both patches is not parted
