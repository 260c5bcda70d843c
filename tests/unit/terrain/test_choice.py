"""Tile choice: hand-worked values, edges that agree, a slow twin in numpy, and the integers shared with the page."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.terrain.choice import CENTRE, SOUTH, WEST, hash_cell, tile_at, tiles_in

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "tile_choice.json").read_text())["cells"]
EDGE = 2**31
coordinates = st.integers(-EDGE, EDGE - 1)
salts = st.integers(0, 2**32 - 1)


def twin(i, j, axis, salt):
    """The same hash in numpy's wrapping 32-bit arithmetic."""
    word = lambda v: np.array([v & 0xFFFFFFFF], np.uint32)  # noqa: E731

    def mix(h):
        h = (h ^ h >> np.uint32(16)) * word(0x85EBCA6B)
        h = (h ^ h >> np.uint32(13)) * word(0xC2B2AE35)
        return h ^ h >> np.uint32(16)

    first = mix(word(i) * word(0x8DA6B343) ^ word(axis) * word(0xCB1AB31F) ^ word(salt))
    return int(mix(first + word(j) * word(0xD8163841))[0])


def test_nothing_hashes_to_nothing():
    assert hash_cell(0, 0, WEST, 0) == 0


def test_the_hash_of_salt_one_is_the_value_worked_by_hand():
    # Round 1: 1 ^ 1 >> 16 = 1; * 85ebca6b = 85ebca6b; ^ 00042f5e (>> 13) = 85efe535; * c2b2ae35 = 65dd47a4 514e79f9, of
    # which the low word stays; ^ 0000514e (>> 16) = 514e28b7. Round 2: ^ 0000514e = 514e79f9; * 85ebca6b = 2a88a8b2
    # 3c9e7513; ^ 0001e4f3 = 3c9f91e0; * c2b2ae35 = 2e1b3cc0 2fef7360; ^ 00002fef = 2fef5c8f
    assert hash_cell(0, 0, WEST, 1) == 0x2FEF5C8F


def test_tile_number_is_read_off_the_edges_around_the_cell():
    west, east = hash_cell(5, 3, WEST, 7) & 1, hash_cell(6, 3, WEST, 7) & 1
    south, north = hash_cell(5, 3, SOUTH, 7) & 1, hash_cell(5, 4, SOUTH, 7) & 1
    centre = (hash_cell(5, 3, CENTRE, 7) >> 1) % 3
    assert tile_at(5, 3, 7, 3) == 16 * centre + 8 * west + 4 * north + 2 * east + south


@pytest.mark.parametrize("cell", GOLDEN, ids=lambda c: f"{c['i']},{c['j']}")
def test_integers_are_those_shared_with_the_page(cell):
    i, j, salt = cell["i"], cell["j"], cell["salt"]
    assert [hash_cell(i, j, axis, salt) for axis in (WEST, SOUTH, CENTRE)] == cell["hashes"]
    assert tile_at(i, j, salt, cell["variants"]) == cell["tile"]


@given(coordinates, coordinates, st.integers(0, 2), salts)
def test_hash_equals_its_twin_in_wrapping_arithmetic(i, j, axis, salt):
    assert hash_cell(i, j, axis, salt) == twin(i, j, axis, salt)


@given(coordinates, coordinates, salts, st.integers(1, 9))
def test_neighbours_agree_on_the_edge_between_them(i, j, salt, variants):
    here, right, above = (tile_at(*cell, salt, variants) for cell in ((i, j), (i + 1, j), (i, j + 1)))
    assert (here >> 1 & 1) == (right >> 3 & 1)
    assert (here >> 2 & 1) == (above & 1)
    assert 0 <= here < 16 * variants


@given(coordinates, coordinates, salts)
def test_the_world_repeats_only_after_two_to_the_32_cells(i, j, salt):
    assert tile_at(i + 2**32, j - 2**32, salt, 3) == tile_at(i, j, salt, 3)


@pytest.mark.parametrize("variants", [1, 2, 3, 16])
@pytest.mark.parametrize("salt", [0, 7, 2**32 - 1])
def test_no_tile_lies_beside_itself_where_another_centre_is_free(variants, salt):
    window = tiles_in(-50, -20, (101, 100), salt, variants)
    beside = np.pad(window, 1, constant_values=-1)
    around = np.stack([beside[1:-1, 2:], beside[1:-1, :-2], beside[2:, 1:-1], beside[:-2, 1:-1]])
    odd = np.add.outer(np.arange(101) - 20, np.arange(100) - 50) % 2 == 1
    repeats = (around == window).any(axis=0) & odd
    repeats[[0, -1]] = repeats[:, [0, -1]] = False  # their neighbours were not asked for
    used = [len({t // 16 for t in around[:, j, i] if t % 16 == window[j, i] % 16}) for j, i in np.argwhere(repeats)]
    assert all(count == variants for count in used)
    # equal edges: 1 in 16 of neighbours to either side, and their centres must be all that there are
    assert len(used) <= {1: 2400, 2: 400, 3: 20, 16: 0}[variants]
    assert (len(used) > 500) == (variants == 1)


@pytest.mark.parametrize("variants", [1, 2, 3])
def test_even_cells_take_what_the_hash_says(variants):
    window = tiles_in(0, 0, (20, 20), 5, variants)
    for j, i in np.ndindex(20, 20):
        if (i + j) % 2 == 0 or variants == 1:
            assert window[j, i] // 16 == (hash_cell(i, j, CENTRE, 5) >> 1) % variants


def test_a_window_names_the_same_tiles_as_its_cells_and_uses_them_all():
    window = tiles_in(-32, 10, (64, 64), 7, 2)
    assert window[3, 5] == tile_at(-27, 13, 7, 2)
    counts = np.bincount(window.ravel(), minlength=32)
    # 4096 cells over 32 tiles: 128 each, binomial standard deviation 11.1; six of them either way
    assert np.abs(counts - 128).max() < 67
