"""A made-up exemplar and its tiles, made once."""

import made_up_tiles
import pytest


@pytest.fixture(scope="session")
def made_up():
    return made_up_tiles.exemplar()


@pytest.fixture(scope="session")
def tiles(made_up):
    return made_up_tiles.tiles_of(made_up)
