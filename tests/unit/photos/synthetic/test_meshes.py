"""Stones, rocks, plants and their parts as meshes."""

from functools import partial

import numpy as np
import pytest

from dav_gswt.photos.synthetic import desert, meshes, planet, plants

PLANTS = {
    "shrub": plants.make_shrub,
    "dry tuft": plants.make_dry_tuft,
    "tuft": plants.make_tuft,
    "seed grass": plants.make_seed_grass,
    "clover": plants.make_clover,
}
PLANTS |= {f"flower {k}": partial(plants.make_flower, kind=f) for k, f in enumerate(plants.MEADOW_FLOWERS)}
PLANTS |= {"bush": partial(plants.make_flower, kind=plants.MEADOW_FLOWERS[0], most=9)}
STONES = {
    "stone": partial(meshes.make_stone, subdivisions=2, palette=desert.STONES),
    "rock": partial(meshes.make_rock, subdivisions=2, palette=planet.ROCKS),
}
MATS = {
    "mat": partial(plants.make_mat, count=40, length=0.12, dry=0.2),
    "stand": partial(plants.make_stand, count=40, length=0.9, width=0.01, tint=plants.TINTS[1]),
    "swathe": lambda rng: plants.make_swathe(rng, [PLANTS["flower 3"](rng) for _ in range(2)], 4, (0.3, 0.4)),
}
EVERY = PLANTS | STONES | MATS


@pytest.mark.parametrize("name", EVERY)
def test_a_mesh_is_that_of_its_seed(name, golden):
    golden(name, *(EVERY[name](np.random.default_rng(seed)) for seed in (1, 2)))
