"""Borders of materials against photographed ones."""

import numpy as np
import pytest
from fixtures import lpips_arrays

from dav_gswt.errors import InputError
from dav_gswt.study.materials import transitions
from dav_gswt.study.materials.transitions import CELLS, PIXELS, MaterialMap

SIDE = 4 * CELLS


@pytest.fixture(scope="module")
def random_weights():
    return lpips_arrays.random()


def stripes(material, seed=0, noise=0.05):
    """A picture of two colours where the material says so."""
    rng = np.random.default_rng(seed)
    colours = np.array([[0.8, 0.7, 0.5], [0.2, 0.5, 0.2]])[np.maximum(material, 0)]
    picture = colours.repeat(PIXELS, 0).repeat(PIXELS, 1)
    picture = picture + noise * rng.normal(size=picture.shape[:2])[..., None]
    return MaterialMap(np.clip(picture, 0, 1).astype(np.float32), material)


def halves(side=SIDE):
    return (np.arange(side) >= side // 2).astype(int) * np.ones((side, 1), int)


def test_borders_are_found_where_two_materials_have_room():
    places = transitions.find_borders(halves(), 8)
    middles = places[:, 1] + CELLS / 2
    assert len(places) and (np.abs(middles - SIDE / 2) <= 0.3 * CELLS + 1).all()


def test_ground_of_one_material_has_no_border():
    assert len(transitions.find_borders(np.zeros((SIDE, SIDE), int), 8)) == 0


def test_squares_inside_a_material_show_no_other():
    places = transitions.find_insides(halves(), 8, 0)
    assert len(places) and (places[:, 1] + CELLS <= SIDE / 2 + 1).all()
    assert len(transitions.find_insides(np.zeros((SIDE, SIDE), int), 8, 1)) == 0


def test_excluded_ground_is_no_border():
    material = halves()
    material[:, SIDE // 2 - 12 : SIDE // 2 + 12] = -1
    assert len(transitions.find_borders(material, 8)) == 0


def test_crops_are_turned_into_all_symmetries():
    crop = np.arange(12.0, dtype=np.float32).reshape(1, 2, 2, 3)
    turned = transitions.turn_crops(crop)
    assert len(turned) == 8 and len({each.tobytes() for each in turned}) == 8


def test_the_nearest_allowed_crops_count():
    apart = np.tile(np.array([[0.0, 1.0, 2.0, 3.0, 9.0]]), (1, 8))
    allowed = np.array([[False, True, True, True, True]])
    assert transitions.average_nearest(apart, allowed)[0] == pytest.approx(2.0)
    assert np.isnan(transitions.average_nearest(apart, np.zeros((1, 5), bool))[0])


def test_like_borders_are_as_near_and_others_farther(random_weights):
    photographed = stripes(halves())
    like = transitions.measure_transitions(photographed, stripes(halves(), 1), random_weights, 0)
    assert like.low <= 0 <= like.high or like.high < 0
    checks = (np.indices((SIDE, SIDE)).sum(0) // 3) % 2
    other = transitions.measure_transitions(photographed, stripes(checks, 1), random_weights, 0)
    assert other.low > 0 and other.terrain > 2 * like.terrain


def test_materials_that_look_otherwise_everywhere_do_so_inside_too(random_weights):
    photographed = stripes(halves())
    like = transitions.measure_transitions(photographed, stripes(halves(), 1), random_weights, 0)
    rough = transitions.measure_transitions(photographed, stripes(halves(), 1, noise=0.3), random_weights, 0)
    assert rough.low > 0 and rough.inside > 0.5 * rough.difference > like.inside


def test_borders_that_look_otherwise_are_not_seen_inside(random_weights):
    fringe = stripes(halves(), 1)
    middle = PIXELS * SIDE // 2
    fringe.picture[:, middle - 8 : middle + 8] = [1, 0, 0]
    found = transitions.measure_transitions(stripes(halves()), fringe, random_weights, 0)
    assert found.low > 0 and abs(found.inside) < 0.5 * found.difference


def test_too_few_photographed_borders_are_refused(random_weights):
    plain = stripes(np.zeros((SIDE, SIDE), int))
    with pytest.raises(InputError, match="too few borders"):
        transitions.measure_transitions(plain, stripes(halves()), random_weights, 0)
