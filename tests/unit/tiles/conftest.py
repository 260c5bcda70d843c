"""A made-up exemplar and its tiles, made once."""

import pytest
from fixtures import tile_sets


@pytest.fixture(scope="session")
def made_up():
    return tile_sets.exemplar()


@pytest.fixture(scope="session")
def tiles(made_up):
    return tile_sets.tiles_of(made_up)
