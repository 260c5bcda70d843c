from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.materials import outlines
from dav_gswt.materials.maps import GroundMaps
from dav_gswt.materials.objects import Footprint
from dav_gswt.tiles.layout import Exemplar

M = 64


def disc(row, column, radius):
    rows, columns = np.mgrid[:M, :M]
    return np.hypot(rows - row, columns - column) < radius


SHRUB, STONE = disc(20, 22, 8), disc(20, 36, 5)


@pytest.fixture
def maps():
    """Sand with a green shrub and a grey stone that are a little higher, under noise."""
    noise = np.random.default_rng(0).normal(0, 0.02, (M, M, 3))
    colour = np.where(SHRUB[..., None], [0.2, 0.4, 0.15], [0.8, 0.7, 0.5])
    colour = np.clip(np.where(STONE[..., None], [0.4, 0.4, 0.42], colour) + noise, 0, 1)
    height = 0.3 * (SHRUB | STONE)
    flat, place = np.zeros((M, M)), Exemplar(0.0, 0.0, 0.1, M)
    return GroundMaps(colour, flat, height, flat, np.ones((M, M), bool), place)


def iou(one, two):
    return (one & two).sum() / (one | two).sum()


@pytest.mark.parametrize("before", [disc(20, 22, 5.5), disc(20, 22, 10), disc(22, 20, 8)])
def test_a_cut_finds_the_outline(maps, before):
    (found,) = outlines.refine_footprints(maps, [Footprint(before, 1)])
    assert iou(found.cells, SHRUB) > 0.9 > iou(before, SHRUB) and found.material == 1


def test_a_cut_depends_on_height_where_colours_agree_and_where_heights_do_too_the_footprint_stays(maps):
    flat = replace(maps, colour=np.full((M, M, 3), 0.5))
    (found,) = outlines.refine_footprints(flat, [Footprint(disc(21, 21, 7), 0)])
    assert iou(found.cells, SHRUB) > 0.9
    before = disc(20, 22, 6)
    (found,) = outlines.refine_footprints(replace(flat, surface=np.zeros((M, M))), [Footprint(before, 0)])
    assert iou(found.cells, before) >= outlines.LEAST_AGREEMENT


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
