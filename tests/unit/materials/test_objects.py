"""What is an object and what is texture, and the outlines of objects."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.materials import objects, outlines
from dav_gswt.materials.maps import GroundMaps, Surroundings
from dav_gswt.materials.objects import Footprint
from dav_gswt.tiles.layout import Exemplar

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


def test_contact_shadow_belongs_to_what_casts_it():
    thing, shadow = box(50, 60, 50, 60), box(52, 58, 61, 64)
    footprints, excluded = find(thing | shadow, standing=[thing])
    assert len(footprints) == 1 and footprints[0].cells[55, 62] and not excluded.any()


SIDE = 64


def disc(row, column, radius):
    rows, columns = np.mgrid[:SIDE, :SIDE]
    return np.hypot(rows - row, columns - column) < radius


SHRUB, STONE = disc(20, 22, 8), disc(20, 36, 5)


@pytest.fixture
def maps():
    """Sand with a green shrub and a grey stone that are a little higher, under noise."""
    noise = np.random.default_rng(0).normal(0, 0.02, (SIDE, SIDE, 3))
    colour = np.where(SHRUB[..., None], [0.2, 0.4, 0.15], [0.8, 0.7, 0.5])
    colour = np.clip(np.where(STONE[..., None], [0.4, 0.4, 0.42], colour) + noise, 0, 1)
    height = 0.3 * (SHRUB | STONE)
    flat, place = np.zeros((SIDE, SIDE)), Exemplar(0.0, 0.0, 0.1, SIDE)
    return GroundMaps(colour, flat, height, flat, np.ones((SIDE, SIDE), bool), place)


def iou(one, two):
    return (one & two).sum() / (one | two).sum()


@pytest.mark.parametrize("before", [disc(20, 22, 5.5), disc(20, 22, 10), disc(22, 20, 8)])
def test_a_cut_finds_the_outline(maps, before):
    (found,) = outlines.refine_footprints(maps, [Footprint(before, 1)])
    assert iou(found.cells, SHRUB) > 0.9 > iou(before, SHRUB) and found.material == 1


def test_footprints_never_overlap_and_keep_their_order(maps):
    first, second = Footprint(disc(20, 22, 7), 0), Footprint(disc(20, 36, 4), 1)
    found = outlines.refine_footprints(maps, [first, second])
    assert not (found[0].cells & found[1].cells).any() and [each.material for each in found] == [0, 1]
    touching = [Footprint(disc(20, 22, 8), 0), Footprint(disc(20, 33, 4), 1)]
    found = outlines.refine_footprints(replace(maps, colour=np.where(maps.colour < 0.6, 0.3, 0.8)), touching)
    assert not (found[0].cells & found[1].cells).any()


@pytest.mark.parametrize("other", [disc(50, 50, 6), disc(20, 22, 18), disc(20, 22, 3)])
def test_an_outline_that_disagrees_is_not_accepted(maps, other):
    assert outlines.accept_outline(disc(20, 22, 7), other, maps.known) is None
