import numpy as np

from dav_gswt.materials.extraction import fill_cells, find_places
from dav_gswt.tiles import energy


def stripes(m=48):
    """Stripes of two cells along x, with a little grain."""
    rng = np.random.default_rng(3)
    bright = 0.3 + 0.4 * (np.arange(m) // 2 % 2)
    return np.repeat(np.broadcast_to(bright[:, None], (m, m))[..., None], 3, -1) + rng.normal(0, 0.01, (m, m, 1))


def fill(colour, source, patch=8):
    terms = energy.SeamEnergy("colour", 0.0, energy.make_colour_layer(colour), None).terms(1.0)
    return fill_cells(colour, terms, source, patch, np.random.default_rng(0))


def hole(m=48):
    source = np.ones((m, m), bool)
    source[14:33, 10:36] = False
    return source


def test_a_regular_ground_goes_on_through_the_hole_with_cells_of_the_source_and_the_rest_stays():
    colour, source = stripes(), hole()
    found, again = (fill(colour, source) for _ in range(2))
    off = np.abs(colour[found.rows, found.columns] - colour)[~source]
    assert off.mean() < 0.02  # grain alone is 0.011; a stripe out of step 0.4
    assert source[found.rows, found.columns].all() and not found.copied[:4].any()
    np.testing.assert_array_equal([found.rows, found.columns], [again.rows, again.columns])


def test_a_full_source_stays_patches_shrink_to_what_a_narrow_one_holds_and_without_room_none_is_placed():
    assert not fill(stripes(), np.ones((48, 48), bool)).copied.any()
    source = np.zeros((48, 48), bool)
    source[20:26] = True
    found = fill(stripes(), source, patch=16)
    assert source[found.rows, found.columns].all()
    source[23:] = False
    assert fill(stripes(), source) is None


def test_places_are_all_squares_that_lie_wholly_in_the_source():
    source = hole()
    every = [(r, c) for r in range(42) for c in range(42) if source[r : r + 7, c : c + 7].all()]
    np.testing.assert_array_equal(find_places(source, 7), every)
    assert find_places(np.ones((5, 5), bool), 6).shape == (0, 2)
