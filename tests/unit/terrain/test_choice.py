"""Tile choice: a hand-worked hash, the integers shared with the page, repetition, and no mirror image."""

import json
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.terrain.choice import CENTRE, SOUTH, WEST, hash_cell, tiles_at

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "tile_choice.json").read_text())["cells"]


@pytest.mark.parametrize("cell", GOLDEN, ids=lambda c: f"{c['i']},{c['j']}")
def test_integers_are_those_shared_with_the_page(cell):
    i, j, salt = cell["i"], cell["j"], cell["salt"]
    assert [hash_cell(i, j, axis, salt) for axis in (WEST, SOUTH, CENTRE)] == cell["hashes"]
    assert tiles_at(np.array([i]), np.array([j]), salt, cell["variants"]).tolist() == [cell["tile"]]


@pytest.mark.parametrize("variants, most", [(1, 2400), (2, 400), (3, 20), (16, 0)])
def test_no_tile_lies_beside_itself_where_another_centre_is_free(variants, most):
    window = tiles_at(*np.meshgrid(np.arange(-50, 50), np.arange(-20, 81)), 7, variants)
    beside = np.pad(window, 1, constant_values=-1)
    around = np.stack([beside[1:-1, 2:], beside[1:-1, :-2], beside[2:, 1:-1], beside[:-2, 1:-1]])
    odd = np.add.outer(np.arange(101) - 20, np.arange(100) - 50) % 2 == 1
    repeats = (around == window).any(axis=0) & odd
    repeats[[0, -1]] = repeats[:, [0, -1]] = False  # their neighbours were not asked for
    used = [len({t // 16 for t in around[:, j, i] if t % 16 == window[j, i] % 16}) for j, i in np.argwhere(repeats)]
    assert all(count == variants for count in used)
    # equal edges: 1 in 16 of neighbours to either side, and their centres must be all that there are
    assert len(used) <= most and (len(used) > 500) == (variants == 1)


@pytest.mark.parametrize("salt", [0, 7])
def test_the_world_has_no_mirror_image(salt):
    i, j = np.meshgrid(np.arange(1, 201), np.arange(1, 201))
    here = hash_cell(i, j, CENTRE, salt)
    for mirrored in ((-i, -j), (-i, j), (i, -j)):
        assert (here == hash_cell(*mirrored, CENTRE, salt)).mean() < 1e-4
    assert (here == hash_cell(j, i, CENTRE, salt))[i != j].mean() < 1e-4
