from dataclasses import replace

import numpy as np
from fixtures import mixed_ground as made
from scipy.ndimage import gaussian_filter

from dav_gswt.materials import segmentation, standing
from dav_gswt.materials.maps import Surroundings

M = made.CELLS


def hill(row, column, radius, height):
    """A smooth bump of some cells, in cells."""
    rows, columns = np.mgrid[:M, :M]
    return height * np.exp(-(((rows - row) ** 2 + (columns - column) ** 2) / (2 * (radius / 2) ** 2)))


def scene(bumps, noise=0.05, colour_too=True):
    """Even ground with bumps, which are darker."""
    maps, rng = made.maps(mixed=False, shrubs=False), np.random.default_rng(0)
    up = np.sum([np.zeros((M, M)), *(hill(*each) for each in bumps)], 0)
    colour = maps.colour.copy()
    if colour_too:
        colour -= 0.3 * np.clip(up / 4, 0, 1)[..., None]
    surface = (up + noise * gaussian_filter(rng.normal(size=(M, M)), 1)) * made.SPACING
    return replace(maps, colour=np.clip(colour, 0, 1), surface=surface)


def find(maps):
    features = segmentation.describe_cells(maps.colour)[..., :3]
    everything, nothing = np.ones((M, M), bool), np.zeros((M, M), bool)
    rise = standing.measure_rise(maps)
    around = Surroundings(
        maps.colour, features, rise, np.zeros((M, M), int), everything, nothing, nothing, everything, frozenset()
    )
    return standing.find_standing_things(around, maps)


def test_bumps_are_found_with_their_outlines():
    bumps = [(30, 30, 7, 6), (90, 40, 6, 5), (60, 95, 8, 7)]
    things = find(scene(bumps))
    assert len(things) == len(bumps)
    for row, column, radius, _ in bumps:
        thing = next(each for each in things if each[row, column])
        assert 0.25 * np.pi * radius**2 < thing.sum() < 2 * np.pi * radius**2
    assert np.sum(things, 0).max() == 1


def test_even_and_sloping_ground_has_none_nor_has_what_rises_without_another_colour():
    """The heights of a fit are wrong in places where nothing stands."""
    maps = scene([])
    slope = 0.5 * made.SPACING * np.arange(M)[None, :]
    for each in (maps, replace(maps, surface=maps.surface + slope), scene([(60, 60, 7, 6)], colour_too=False)):
        assert find(each) == []


def test_one_stone_among_many_is_none():
    rng = np.random.default_rng(1)
    field = [(r + rng.uniform(-2, 2), c + rng.uniform(-2, 2), 6, 5) for r in range(8, M, 13) for c in range(8, M, 13)]
    assert find(scene(field)) == []
