import numpy as np
import pytest

from dav_gswt.materials import objects
from dav_gswt.materials.maps import Surroundings

M = 120


def around(things, pieces=None, strips=None, rough=(), colour=None):
    """Even ground of one material around things."""
    features = np.zeros((M, M, 3))
    features[things] = [-20.0, 5.0, 5.0]
    light, none = np.full((M, M, 3), 0.6), np.zeros((M, M), bool)
    light[things] = [0.2, 0.25, 0.1] if colour is None else colour
    pieces, strips = none if pieces is None else pieces, none if strips is None else strips
    flat, one = np.zeros((M, M)), np.zeros((M, M), int)
    return Surroundings(light, features, flat, one, ~things, pieces, strips, ~none, frozenset(rough))


def box(*edges):
    cells, (top, bottom, left, right) = np.zeros((M, M), bool), edges
    cells[top:bottom, left:right] = True
    return cells


def find(things, standing=(), **options):
    return objects.find_footprints(list(standing), things, around(things, **options))


MARKER = np.where(np.indices((10, 10)).sum(0) % 2, 0.95, 0.05).reshape(-1, 1) * np.ones(3)


@pytest.mark.parametrize(
    ("cells", "options"),
    [
        ((0, 10, 40, 50), {}),  # at the border
        ((50, 54, 20, 80), {}),  # long
        ((40, 70, 40, 70), {}),  # large
        ((50, 60, 50, 60), {"pieces": box(50, 60, 50, 60)}),  # of another material
        ((50, 60, 50, 60), {"strips": box(0, M, 61, 66)}),  # beside a strip
        ((50, 60, 50, 60), {"colour": [0.25, 0.27, 0.33]}),  # shade
        ((50, 60, 50, 60), {"colour": MARKER}),
    ],
)
def test_what_is_no_object_is_excluded(cells, options):
    things = box(*cells)
    footprints, excluded = find(things, **options)
    assert not footprints and excluded[things].mean() > 0.85 and not excluded[~things].any()


def test_specks_stay_texture_and_on_rough_ground_so_does_the_largest_of_many():
    footprints, excluded = find(box(50, 52, 50, 52))
    assert not footprints and not excluded.any()
    specks = np.any([box(r, r + 3, c, c + 3) for r in range(10, 110, 12) for c in range(10, 110, 12)], 0)
    specks[45:75, 45:75] = False
    things = specks | box(56, 63, 56, 63)
    footprints, excluded = find(things, rough=(0,))
    assert not footprints and not excluded.any()
    assert len(find(things)[0]) == 1


@pytest.mark.parametrize(("rough", "alike", "found"), [(True, 0.3, 0), (True, 0.05, 1), (False, 0.3, 1)])
def test_a_stone_in_a_field_of_stones_is_texture(rough, alike, found):
    own = box(50, 60, 40, 50)
    ground = around(own, rough=(0,) if rough else ())
    stones = np.random.default_rng(0).random((M, M)) < alike
    ground.features[stones] = ground.features[55, 45]
    footprints, excluded = objects.find_footprints([own], own, ground)
    assert len(footprints) == found and not excluded.any()


def test_things_that_touch_are_split():
    rows, columns = np.mgrid[:M, :M]
    middles = [(60, 45), (60, 56), (60, 67), (71, 67), (82, 67)]
    discs = [(rows - r) ** 2 + (columns - c) ** 2 <= 36 for r, c in middles]
    things = objects.split_things(np.any(discs, 0))
    assert len(things) == len(discs)
    assert all(any((thing & disc).sum() > 0.8 * disc.sum() for disc in discs) for thing in things)


def test_contact_shadow_belongs_to_what_casts_it():
    thing, shadow = box(50, 60, 50, 60), box(52, 58, 61, 64)
    footprints, excluded = find(thing | shadow, standing=[thing])
    assert len(footprints) == 1 and footprints[0].cells[55, 62] and not excluded.any()


@pytest.mark.parametrize(
    ("ratio", "shaded"), [((0.3, 0.35, 0.45), True), ((0.3, 0.3, 0.2), False), ((0.9, 0.9, 1.0), False)]
)
def test_shade_is_darker_and_bluer(ratio, shaded):
    light = np.array([0.5, 0.4, 0.3])
    assert objects.is_shade(light * ratio, light) == shaded
    np.testing.assert_allclose(objects.linear_light(np.full((2, 3), 0.5)), 0.21404114, rtol=1e-6)
