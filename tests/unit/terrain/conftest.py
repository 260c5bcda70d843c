"""Terrains that the tests of this folder share."""

from dataclasses import replace

import pytest
from fixtures import terrains


@pytest.fixture(scope="session")
def terrain():
    return terrains.two_level_terrain()


@pytest.fixture(scope="session")
def hilly(terrain):
    return replace(terrain, heights=terrains.HILLS)


@pytest.fixture(scope="session")
def stony():
    return terrains.stony_terrain()
