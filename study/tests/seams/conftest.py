"""A synthetic exemplar, its tiles cut by colour and straight, placed as terrain; made once."""

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt_study.seams import placed_tiles


@pytest.fixture(scope="session")
def sample_ground():
    return tile_sets.exemplar()


@pytest.fixture(scope="session")
def tiles(sample_ground):
    return tile_sets.tiles_of(sample_ground, "colour")


@pytest.fixture(scope="session")
def source(sample_ground, tiles):
    width = 0.2 * tiles.layout.side
    return placed_tiles.detrend_exemplar(sample_ground.levels, sample_ground.exemplar, sample_ground.colour, width)


@pytest.fixture(scope="session")
def placed(tiles, source):
    return placed_tiles.place_tiles(tiles, source, 3, 0.6)


@pytest.fixture(scope="session")
def straight(sample_ground, source):
    return placed_tiles.place_tiles(tile_sets.tiles_of(sample_ground, "none", corrected=False), source, 3, 0.6)


@pytest.fixture()
def rng():
    return np.random.default_rng(0)
