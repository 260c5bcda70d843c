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


@pytest.mark.parametrize("name", STONES)
def test_a_stone_is_closed_outside_out_and_about_1_across(name):
    for seed in range(3):
        stone = STONES[name](np.random.default_rng(seed))
        a, b, c = (stone.vertices[stone.faces[:, i]].astype(float) for i in range(3))
        spans = np.ptp(stone.vertices, axis=0)
        assert 0.5 < spans[0] < 1.4 and spans[2] < spans[0]
        assert 0 < (np.cross(a, b) * c).sum() / 6 < np.prod(spans)  # its volume, if closed and outside out
        assert np.cross(b - a, c - a).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-5)  # closed
        assert stone.colours.min() > 0 and stone.colours.max() < 1


def test_a_fresh_crater_has_its_depth_its_rim_and_an_end():
    one, round_ = np.array([[0.5, -0.2, 2.0, 1.0]]), np.zeros((1, 6))
    r = np.array([0.0, 0.5, 1.0, 1.2, 2.0, 3.5, 4.0])
    z = planet.crater_relief(0.5 + r, np.full(r.shape, -0.2), one, round_)
    assert z[0] == pytest.approx(-2.0 * planet.DEPTH, rel=1e-6)
    assert z[2:4].max() == pytest.approx(2.0 * planet.RIM, rel=0.5) and z[2] > z[1]
    assert z[3] > z[4] > 0 and z[5] == z[6] == 0
