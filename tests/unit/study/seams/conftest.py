"""The made-up exemplar, its tiles cut by colour and straight, laid; made once."""

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt.study.seams import ground


@pytest.fixture(scope="session")
def made_up():
    return tile_sets.exemplar()


@pytest.fixture(scope="session")
def tiles(made_up):
    return tile_sets.tiles_of(made_up, "colour")


@pytest.fixture(scope="session")
def source(made_up, tiles):
    width = 0.2 * tiles.seams["layout"]["side"]
    return ground.source_of(made_up.levels, made_up.exemplar, made_up.colour, width)


@pytest.fixture(scope="session")
def laid(tiles, source):
    return ground.laid(tiles, source, 3, 0.6)


@pytest.fixture(scope="session")
def straight(made_up, source):
    return ground.laid(tile_sets.tiles_of(made_up, "none", corrected=False), source, 3, 0.6)


@pytest.fixture()
def rng():
    return np.random.default_rng(0)
