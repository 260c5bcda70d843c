from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made

from dav_gswt.materials import classes
from dav_gswt.materials.maps import GroundMaps, GroundMasks
from dav_gswt.tiles.layout import Exemplar


@pytest.fixture(scope="module")
def found():
    return classes.classify_ground(made.maps())


def test_materials_are_those_of_the_ground_and_every_shrub_is_an_object_on_sand(found):
    assert found.number == 2
    free = ~found.excluded & ~found.occupied
    assert (found.materials == made.true_materials())[free].mean() > 0.97
    assert len(found.footprints) == len(made.SHRUBS)
    assert {footprint.material for footprint in found.footprints} == {0}
    true = made.shrub_cells()
    assert (found.occupied & true).sum() > 0.9 * true.sum() and found.occupied.sum() < 2.5 * true.sum()
    assert not (found.source(0) & true).any()
    assert found.shares.sum() == pytest.approx(1)
    assert found.shares[0] == pytest.approx(np.mean(made.true_materials() == 0), abs=0.04)


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


@pytest.mark.parametrize("rows", [slice(0, 24), slice(48, 80)])
def test_a_wood_of_many_colours_is_no_texture_of_the_ground_beside_it(rows):
    """Crowns and the dark between them, in classes of which none is wide, over a fifth of the ground and more."""
    labels, rng = np.zeros((128, 128), int), np.random.default_rng(3)
    wood = np.zeros(labels.shape, bool)
    wood[rows] = True
    labels[wood] = rng.integers(1, 6, (32, 32)).repeat(4, 0).repeat(4, 1)[wood]
    meadow = ~wood & (np.arange(128) > 40)
    labels[(rng.random(labels.shape) < 0.15) & meadow] = 1
    assert not classes.find_growth(labels, [0]).any()
    labels[(rng.random(labels.shape) < 0.45) & meadow] = 2
    growth = classes.find_growth(labels, [0])
    assert not growth[wood].any() and growth[meadow].mean() > 0.4


def test_swathes_of_flowers_of_many_kinds_are_texture():
    """Flowers over a fifth of the side, and plain ground hardly wider than a material's least."""
    kinds = np.random.default_rng(3).integers(1, 6, (32, 32)).repeat(4, 0).repeat(4, 1)
    swathes = (np.arange(128) + 35) % 44 < 26
    assert (classes.find_growth(kinds * swathes, [0]) == swathes).all()


def things_on(ground, thing, size=128, number=8):
    """Even ground with round things on it, flat, and the share that these cover."""
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:size, :size] * 128 / size
    colour = np.array(ground) * (1.0 + rng.normal(0, 0.02, (size, size, 1)))
    cells = np.zeros((size, size), bool)
    for k in range(number):
        cells |= np.hypot(rows - 25 - 40 * (k % 3), columns - 25 - 40 * (k // 3)) < 5
    colour[cells] = thing
    flat = np.zeros((size, size))
    exemplar = Exemplar(0.0, 0.0, 0.1 * 128 / size, size)
    return GroundMaps(np.clip(colour, 0, 1), flat, flat, flat, flat == 0, exemplar), cells.mean()


@pytest.mark.parametrize(
    ("ground", "thing", "size"),
    [
        ((0.92, 0.93, 0.95), (0.2, 0.19, 0.18), 128),  # dark on snow
        pytest.param(made.SAND, (0.2, 0.27, 0.12), 384, marks=pytest.mark.slow),
    ],
)
def test_things_are_objects_at_any_resolution_and_keep_no_ground_around_them(ground, thing, size):
    maps, covered = things_on(ground, thing, size)
    found = classes.classify_ground(maps)
    assert found.number == 1 and len(found.footprints) == 8
    assert (found.excluded | found.occupied).mean() < 2 * covered


def test_named_materials_are_taken_as_they_are_and_ground_without_a_name_or_a_photo_is_excluded():
    maps = made.maps(mixed=False, shrubs=False)
    left, top, known = (np.zeros(maps.known.shape, bool) for _ in range(3))
    left[:, :40], top[100:], known[20:] = True, True, True
    maps = replace(maps, known=known)
    found = classes.classify_ground(maps, GroundMasks({"west": left, "east": ~left}, top))
    assert found.names == ["east", "west"]
    assert (found.materials[:100, :40] == 1).all() and (found.materials[:100, 40:] == 0).all()
    assert found.excluded[100:].all() and found.excluded[:20].all() and not found.excluded[25:95, 50:].any()
    found = classes.classify_ground(maps, GroundMasks({"west": left}, top & ~top))
    assert found.excluded[:, 40:].all() and not found.excluded[20:, :40].any()
    found = classes.classify_ground(made.maps(shrubs=False), GroundMasks({}, top))  # materials are found beside it
    assert found.excluded[100:].all() and found.number == 2
