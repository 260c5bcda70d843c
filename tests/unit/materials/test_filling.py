import numpy as np
import pytest

from dav_gswt.materials.filling import CellSources, box_sums, fill_cells, find_places
from dav_gswt.tiles import energy


def stripes(m=48):
    """Stripes of two cells along x, with a little grain."""
    rng = np.random.default_rng(3)
    bright = 0.3 + 0.4 * (np.arange(m) // 2 % 2)
    return np.repeat(np.broadcast_to(bright[:, None], (m, m))[..., None], 3, -1) + rng.normal(0, 0.01, (m, m, 1))


def fill(colour, source, patch=8, seed=0):
    terms = energy.SeamEnergy("colour", 0.0, energy.make_colour_layer(colour), None).terms(1.0)
    return fill_cells(colour, terms, source, patch, np.random.default_rng(seed))


def hole(m=48):
    source = np.ones((m, m), bool)
    source[14:33, 10:36] = False
    return source


def test_every_cell_shows_a_cell_of_the_source():
    source = hole()
    found = fill(stripes(), source)
    assert source[found.rows, found.columns].all()


def test_a_regular_ground_goes_on_through_the_hole():
    colour, source = stripes(), hole()
    found = fill(colour, source)
    off = np.abs(colour[found.rows, found.columns] - colour)[~source]
    assert off.mean() < 0.02  # grain alone is 0.011; a stripe out of step 0.4


def test_ground_far_from_the_hole_stays():
    found = fill(stripes(), hole())
    assert not found.copied[:4].any()


def test_the_same_generator_fills_alike():
    first, second = (fill(stripes(), hole(), seed=5) for _ in range(2))
    np.testing.assert_array_equal(first.rows, second.rows)
    np.testing.assert_array_equal(first.columns, second.columns)


def test_a_full_source_is_left_as_it_is():
    found = fill(stripes(), np.ones((48, 48), bool))
    assert not found.copied.any()


def test_patches_shrink_to_what_a_narrow_source_holds():
    source = np.zeros((48, 48), bool)
    source[20:26] = True
    found = fill(stripes(), source, patch=16)
    assert source[found.rows, found.columns].all()


def test_a_source_without_room_for_a_patch_is_refused():
    source = np.zeros((48, 48), bool)
    source[20:23] = True
    assert fill(stripes(), source) is None


@pytest.mark.parametrize("patch", [3, 7])
def test_places_lie_wholly_in_the_source(patch):
    source = hole()
    for row, column in find_places(source, patch):
        assert source[row : row + patch, column : column + patch].all()
    assert len(find_places(source, patch)) == (box_sums(source, patch) == patch**2).sum()


def test_no_place_is_wider_than_the_map():
    assert find_places(np.ones((5, 5), bool), 6).shape == (0, 2)


def test_identity_copies_nothing():
    assert not CellSources.identity(4).copied.any()
