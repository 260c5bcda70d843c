"""A made-up exemplar and its tiles, made once."""

import pytest
from fixtures import tile_sets


@pytest.fixture(scope="session")
def sample_ground():
    return tile_sets.exemplar()


@pytest.fixture(scope="session")
def tiles(sample_ground):
    return tile_sets.tiles_of(sample_ground)
