"""A made-up exemplar and its tiles, made once."""

import pytest
from fixtures import tiles


@pytest.fixture(scope="session")
def made_up():
    return tiles.exemplar()


@pytest.fixture(scope="session")
def tiles(made_up):
    return tiles.tiles_of(made_up)
