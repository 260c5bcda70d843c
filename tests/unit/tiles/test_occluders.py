"""What stands hides the ground, and seams go around it."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.tiles import cuts, energy, occluders
from dav_gswt.tiles.layout import Exemplar

EXEMPLAR = Exemplar(-1.0, 2.0, 0.5, 4)


GROUND = [-0.1, 3.9, 0.0, 0.1, 0.9]


def a_field(*rows):
    """Gaussians of (x, y, z, standard deviation, opacity), round; the first one is ground."""
    x, y, z, size, opacity = np.array([GROUND, *rows], float).T
    n = len(x)
    return GaussianField(
        np.stack([x, y, z], 1).astype(np.float32),
        np.repeat(np.log(size)[:, None], 3, 1).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.log(opacity / (1 - opacity)).astype(np.float32),
        rgb_to_sh(np.full((n, 3), 0.5)),
        np.zeros(n, np.float32),
        np.arange(n) == 0,
    )


def test_cover_is_the_opaque_area_over_a_cell():
    # over cells (0, 0) and (2, 1), far up or just over half a cell
    field = a_field([-0.9, 2.1, 9.0, 0.05, 0.8], [0.2, 2.6, 0.26, 0.1, 0.5], [0.2, 2.6, 0.26, 0.1, 0.5])
    found = occluders.compute_cover(field, EXEMPLAR, np.zeros((4, 4)))
    expected = np.zeros((4, 4))
    expected[0, 0] = 0.8 * 2 * np.pi * 0.05**2 / 0.25
    expected[1, 2] = 2 * 0.5 * 2 * np.pi * 0.1**2 / 0.25
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_what_lies_on_the_ground_or_under_it_hides_nothing():
    field = a_field([-0.9, 2.1, 0.2, 1.0, 0.9], [-0.4, 2.1, -3.0, 1.0, 0.9])
    assert not occluders.compute_cover(field, EXEMPLAR, np.zeros((4, 4))).any()
    assert occluders.compute_cover(field, EXEMPLAR, np.full((4, 4), -4.0)).any()  # of a ground below them they stand


def test_cover_is_at_most_one_and_nothing_stands_on_ground_that_is_not_known():
    field = a_field([-0.9, 2.1, 5.0, 9.0, 0.99], [-0.4, 2.1, 5.0, 9.0, 0.99])
    height = np.zeros((4, 4))
    height[0, 1] = np.nan
    found = occluders.compute_cover(field, EXEMPLAR, height)
    assert found[0, 0] == 1 and found.sum() == 1


def test_a_field_without_ground_does_not_tell_what_stands():
    field = a_field([-0.9, 2.1, 5.0, 0.1, 0.9])
    without = replace(field, ground=np.zeros(2, bool))
    assert occluders.compute_cover(field, EXEMPLAR, np.zeros((4, 4))).any()
    assert not occluders.compute_cover(without, EXEMPLAR, np.zeros((4, 4))).any()


def test_nothing_that_stands_is_no_layer():
    assert energy.make_occluder_layer(np.zeros((3, 3))) is None
    plain = energy.SeamEnergy(
        "colour", 2.0, energy.make_colour_layer(np.random.default_rng(0).random((3, 3, 3))), None, None
    )
    assert len(plain.terms(1.0)) == 1


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
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


def test_a_seam_goes_around_a_shrub_that_looks_like_the_ground():
    """Both patches show one colour, but for less and less of a tint towards column 3, where a shrub stands in one."""
    cover, colour = np.zeros((7, 14)), np.full((7, 14, 1), 0.5)
    cover[2:5, 2:5] = 1
    rows, columns = np.mgrid[:7, :7]
    colour[:, 7:, 0] += 0.02 * np.abs(columns - 3)
    colours = energy.ColourLayer(colour, np.zeros((7, 14, 2)), energy.LayerScales(1.0, 1.0))
    shrub = cover[:, :7] > 0

    def parted(stands):
        terms = energy.SeamEnergy("colour", 2.0, colours, None, stands).terms(1.0)
        costs = energy.compute_edge_costs(terms, (rows, columns), (rows, columns + 7))
        labels = cuts.find_cut(*costs, columns == 0, columns == 6).labels
        return 0 < labels[shrub].sum() < shrub.sum()

    assert parted(None) and not parted(energy.make_occluder_layer(cover))
