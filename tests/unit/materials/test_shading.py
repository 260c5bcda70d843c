from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dav_gswt.images.srgb import decode_srgb, encode_srgb
from dav_gswt.materials import classes, shading
from dav_gswt.materials.maps import GroundMaps
from dav_gswt.tiles.layout import Exemplar

M = 128
SUN = shading.Sun(np.array([0.8, 0.0, 0.6]), np.array([0.25, 0.3, 0.4]), 1.0)
SAND, LOAM = np.array([0.5, 0.38, 0.25]), np.array([0.2, 0.12, 0.07])


def heaps(albedo, lit=True):
    """Two heaps on uneven ground, and the maps of it in the sun, or in even light."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:M, :M]
    height = 6 * gaussian_filter(rng.normal(size=(M, M)), 5)
    for row, column in ((40, 40), (85, 90)):
        height += 0.5 * np.maximum(0, 30 - np.hypot(y - row, x - column))
    yes = np.ones((M, M), bool)
    maps = GroundMaps(np.zeros((M, M, 3)), height, height, np.zeros((M, M)), yes, Exemplar(0.0, 0.0, 1.0, M))
    light = np.broadcast_to(albedo, (M, M, 3)) * np.exp(0.05 * rng.normal(size=(M, M, 1)))
    light = light * SUN.shade(shading.measure_normals(maps)) if lit else light
    return replace(maps, colour=encode_srgb(light))


def halves():
    return np.where((np.arange(M) < M // 2)[:, None, None], SAND, LOAM) * np.ones((M, M, 1))


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
    side = np.broadcast_to((np.arange(M) < M // 2)[:, None], (M, M))
    assert (
        max((found.materials == k)[free & side].mean() + (found.materials != k)[free & ~side].mean() for k in (0, 1))
        > 1.9
    )
