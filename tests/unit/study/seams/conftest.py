"""A synthetic exemplar, its tiles cut by colour and straight, placed as terrain; made once."""

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt.study.seams import placed_tiles


@pytest.fixture(scope="session")
def made_up():
    return tile_sets.exemplar()


@pytest.fixture(scope="session")
def tiles(made_up):
    return tile_sets.tiles_of(made_up, "colour")


@pytest.fixture(scope="session")
def source(made_up, tiles):
    width = 0.2 * tiles.report.layout.side
    return placed_tiles.detrend_exemplar(made_up.levels, made_up.exemplar, made_up.colour, width)


@pytest.fixture(scope="session")
def placed(tiles, source):
    return placed_tiles.place_tiles(tiles, source, 3, 0.6)


@pytest.fixture(scope="session")
def straight(made_up, source):
    return placed_tiles.place_tiles(tile_sets.tiles_of(made_up, "none", corrected=False), source, 3, 0.6)


@pytest.fixture()
def rng():
    return np.random.default_rng(0)
