"""Grass, clover and flowers as meshes."""

import numpy as np
import pytest

from dav_gswt.photos.synthetic import meadow_plants


def mat(rng):
    return meadow_plants.make_mat(rng, 200, 0.12, 0.2)


def flowers(kind):
    return lambda rng: meadow_plants.make_flower(rng, kind)


PLANTS = [
    pytest.param(meadow_plants.make_tuft, id="tuft"),
    pytest.param(meadow_plants.make_seed_grass, id="grass in seed"),
    pytest.param(meadow_plants.make_clover, id="clover"),
    *(pytest.param(flowers(kind), id=f"{kind.petals} petals") for kind in meadow_plants.FLOWERS),
]


@pytest.mark.parametrize("grow", PLANTS)
def test_a_plant_of_a_meadow_stands_on_its_root_about_1_high_in_reflectances(grow):
    for seed in range(4):
        plant = grow(np.random.default_rng(seed))
        assert 0.5 < plant.vertices[:, 2].max() < 1.6
        assert plant.vertices[:, 2].min() > -0.6  # blades may droop below the root, on a slope
        assert np.isfinite(plant.vertices).all()
        assert plant.colours.min() > 0 and plant.colours.max() < 1
        assert plant.faces.min() == 0 and plant.faces.max() == len(plant.vertices) - 1


@pytest.mark.parametrize("grow", [pytest.param(mat, id="mat"), *PLANTS])
def test_every_face_of_what_grows_has_one_colour(grow):
    plant = grow(np.random.default_rng(1))
    assert np.ptp(plant.colours[plant.faces], axis=1).max() == 0


def test_a_mat_is_about_1_across_and_as_high_as_its_blades():
    made = mat(np.random.default_rng(0))
    assert len(made.faces) == 200 * 4  # two pieces a blade, two triangles a piece
    root = np.hypot(*made.vertices[:, :2].T)
    assert 0.45 < np.quantile(root, 0.9) < 0.6
    assert 0.08 < made.vertices[:, 2].max() < 1.3 * 0.12 + 0.02  # the longest blade, and half its width


def test_dry_grass_is_redder_than_green():
    green, dry = (
        meadow_plants.make_mat(np.random.default_rng(0), 200, 0.1, share).colours.mean(axis=0) for share in (0.0, 1.0)
    )
    assert dry[0] > dry[1] and green[1] > green[0]


def test_a_flower_has_the_colours_of_its_kind():
    for kind in meadow_plants.FLOWERS:
        colours = meadow_plants.make_flower(np.random.default_rng(2), kind).colours
        # a petal's shade is 0.85 to 1.08 times the kind's, and 0.88 of that in its inner part
        share = (colours / np.array(kind.colour)).round(3)
        petals = (np.ptp(share, axis=1) < 0.02) & (share[:, 0] > 0.74) & (share[:, 0] < 1.09)
        assert petals.sum() >= kind.petals * 8
