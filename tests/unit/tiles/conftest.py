"""A made-up exemplar and its tiles, made once, and a way to cut other ones."""

import numpy as np
import pytest
from fixtures import tile_sets

from dav_gswt.tiles import build


@pytest.fixture(scope="session")
def sample_ground():
    return tile_sets.exemplar()


@pytest.fixture(scope="session")
def tiles(sample_ground):
    return tile_sets.tiles_of(sample_ground)


@pytest.fixture(scope="session")
def cut(sample_ground):
    """Cut tiles of the exemplar, in few tries, with other maps, levels or options."""

    def make(colour=sample_ground.colour, uncertainty=None, levels=sample_ground.levels, wanted=None, **options):
        few = {"share": 0.5, "strip": 0.17, "candidates": 20, "tries": 1}
        uncertainty = np.zeros((96, 96)) if uncertainty is None else uncertainty
        chosen, rng = build.TilingOptions(**few | options, levels=wanted), np.random.default_rng(2)
        return build.cut_tiles(levels, sample_ground.exemplar, colour, uncertainty, chosen, rng)

    return make
