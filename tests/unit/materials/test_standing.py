"""What stands on the ground, and the sun that its relief tells."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made
from scipy.ndimage import gaussian_filter

from dav_gswt.images.srgb import decode_srgb, encode_srgb
from dav_gswt.materials import classes, segmentation, shading, standing
from dav_gswt.materials.maps import GroundMaps, Surroundings
from dav_gswt.tiles.layout import Exemplar

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


SIDE = 128
SUN = shading.Sun(np.array([0.8, 0.0, 0.6]), np.array([0.25, 0.3, 0.4]), 1.0)
SAND, LOAM = np.array([0.5, 0.38, 0.25]), np.array([0.2, 0.12, 0.07])


def heaps(albedo, lit=True):
    """Two heaps on uneven ground, and the maps of it in the sun, or in even light."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:SIDE, :SIDE]
    height = 6 * gaussian_filter(rng.normal(size=(SIDE, SIDE)), 5)
    for row, column in ((40, 40), (85, 90)):
        height += 0.5 * np.maximum(0, 30 - np.hypot(y - row, x - column))
    yes = np.ones((SIDE, SIDE), bool)
    maps = GroundMaps(
        np.zeros((SIDE, SIDE, 3)), height, height, np.zeros((SIDE, SIDE)), yes, Exemplar(0.0, 0.0, 1.0, SIDE)
    )
    light = np.broadcast_to(albedo, (SIDE, SIDE, 3)) * np.exp(0.05 * rng.normal(size=(SIDE, SIDE, 1)))
    light = light * SUN.shade(shading.measure_normals(maps)) if lit else light
    return replace(maps, colour=encode_srgb(light))


def halves():
    return np.where((np.arange(SIDE) < SIDE // 2)[:, None, None], SAND, LOAM) * np.ones((SIDE, SIDE, 1))


def test_the_sun_on_heaps_is_found_whatever_they_are_made_of():
    for albedo in (SAND, halves()):
        found = shading.fit_sun(heaps(albedo))
        assert found is not None
        assert found.azimuth == pytest.approx(90, abs=10)  # one step of those tried
        assert classes.classify_ground(heaps(albedo)).sun.azimuth == found.azimuth


def test_ground_of_one_albedo_has_one_light_without_its_shading():
    found = shading.fit_sun(heaps(SAND))
    assert found is not None and found.explained > 0.8
    assert found.ambient == pytest.approx(SUN.ambient, abs=0.11)  # one step of those that are tried
    spread = [
        np.std(decode_srgb(maps.colour).reshape(-1, 3) / SAND, 0).max()
        for maps in (shading.even_light(heaps(SAND), found), heaps(SAND))
    ]
    assert spread[0] < 0.5 * spread[1]


def test_even_light_tells_no_sun():
    for albedo in (SAND, halves()):
        assert shading.fit_sun(heaps(albedo, lit=False)) is None


def test_classes_are_those_of_the_ground_and_not_of_its_light():
    assert classes.classify_ground(heaps(SAND)).number == 1
    found = classes.classify_ground(heaps(halves()))
    assert found.number == 2
    free = ~found.excluded & ~found.occupied
    side = np.broadcast_to((np.arange(SIDE) < SIDE // 2)[:, None], (SIDE, SIDE))
    assert (
        max((found.materials == k)[free & side].mean() + (found.materials != k)[free & ~side].mean() for k in (0, 1))
        > 1.9
    )
