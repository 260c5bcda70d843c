from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.materials import classes, objects


@pytest.fixture(scope="module")
def found():
    return classes.classify_ground(made.maps())


def test_materials_are_those_of_the_ground(found):
    assert found.number == 2
    free = ~found.excluded & ~found.occupied
    assert (found.materials == made.true_materials())[free].mean() > 0.97


def test_every_shrub_is_an_object_on_sand(found):
    assert len(found.footprints) == len(made.SHRUBS)
    assert {footprint.material for footprint in found.footprints} == {0}
    true = made.shrub_cells()
    assert (found.occupied & true).sum() > 0.9 * true.sum()
    assert found.occupied.sum() < 2.5 * true.sum()


def test_objects_are_no_source(found):
    assert not (found.source(0) & made.shrub_cells()).any()


def test_shares_sum_to_one(found):
    assert found.shares.sum() == pytest.approx(1)
    assert found.shares[0] == pytest.approx(np.mean(made.true_materials() == 0), abs=0.04)


def test_even_ground_is_one_material_without_objects():
    found = classes.classify_ground(made.maps(mixed=False, shrubs=False))
    assert (found.number, found.footprints, found.excluded.any()) == (1, [], False)


def test_ground_that_no_photo_saw_is_excluded():
    maps = made.maps(mixed=False, shrubs=False)
    known = maps.known.copy()
    known[:20, :20] = False
    found = classes.classify_ground(replace(maps, known=known))
    assert found.excluded[:20, :20].all()


def test_shade_of_a_material_is_no_material():
    maps = made.maps(mixed=False, shrubs=False)
    colour = maps.colour.copy()
    colour[:, 70:] = np.clip(colour[:, 70:] * [0.42, 0.47, 0.60], 0, 1)
    found = classes.classify_ground(replace(maps, colour=colour))
    assert found.number == 1
    assert found.excluded[:, 80:].mean() > 0.9


def test_darker_ground_of_coarser_grain_is_a_material():
    maps, rng = made.maps(mixed=False, shrubs=False), np.random.default_rng(1)
    colour = maps.colour.copy()
    stones = rng.random((16, 8)).repeat(8, 0).repeat(8, 1)[..., None] * [0.5, 0.55, 0.7]
    colour[:, 64:] = 0.1 + stones
    assert classes.classify_ground(replace(maps, colour=np.clip(colour, 0, 1))).number == 2


@pytest.mark.parametrize(
    ("ratio", "shade"), [((0.3, 0.35, 0.45), True), ((0.3, 0.3, 0.2), False), ((0.9, 0.9, 1.0), False)]
)
def test_shade_is_darker_and_bluer(ratio, shade):
    light = np.array([0.5, 0.4, 0.3])
    assert classes.is_shade(light * ratio, light) == shade


def test_dense_growth_of_several_colours_is_texture():
    maps, rng = made.maps(mixed=False, shrubs=False), np.random.default_rng(2)
    colour = np.broadcast_to(np.array(made.GRASS), maps.colour.shape) + rng.normal(0, 0.02, maps.colour.shape)
    blooms = rng.random((16, 16)).repeat(8, 0).repeat(8, 1)
    colour[blooms < 0.25] = [0.8, 0.2, 0.15]
    colour[blooms > 0.8] = [0.9, 0.9, 0.85]
    found = classes.classify_ground(replace(maps, colour=np.clip(colour, 0, 1)))
    assert (found.number, found.excluded.mean() < 0.02) == (1, True)


def test_things_at_the_border_are_excluded_and_no_objects():
    things = np.zeros((100, 100), bool)
    things[0:10, 40:50] = True
    things[40:50, 40:50] = True
    footprints, excluded = objects.find_footprints(things, np.zeros((100, 100), int), np.ones((100, 100), bool))
    assert [footprint.cells[45, 45] for footprint in footprints] == [True]
    assert excluded[5, 45] and not excluded[45, 45]


def test_long_things_are_no_objects():
    things = np.zeros((100, 100), bool)
    things[50:54, 20:80] = True
    footprints, excluded = objects.find_footprints(things, np.zeros((100, 100), int), np.ones((100, 100), bool))
    assert not footprints and excluded[52, 50]


def test_specks_stay_texture():
    things = np.zeros((100, 100), bool)
    things[50, 50] = True
    footprints, excluded = objects.find_footprints(things, np.zeros((100, 100), int), np.ones((100, 100), bool))
    assert not footprints and not excluded.any()


def test_dense_growth_is_texture():
    things = np.zeros((10, 10), bool)
    things[:, ::2] = True
    assert objects.is_dense(things, np.ones((10, 10), bool))
    assert not objects.is_dense(np.zeros((10, 10), bool), np.ones((10, 10), bool))
