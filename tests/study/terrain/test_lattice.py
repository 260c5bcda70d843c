"""How visibly a terrain repeats, from pictures whose repetition is known."""

from pathlib import Path

import numpy as np
import pytest
from fixtures import land_covers
from scipy.ndimage import gaussian_filter

from dav_gswt.bundle import store
from dav_gswt.study.terrain import lattice
from dav_gswt.terrain import endless

SCHEMA = Path(__file__).parents[4] / "workflow/schemas/davgswt.schema.json"
PIXELS, TILES = 32, 12


def texture(seed, shape, blur=1.0):
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=shape), blur, mode="wrap")
    return 0.5 + 0.1 * noise[..., None] / noise.std() * np.ones(3)


def tiled(kinds, seed=0):
    """Cells that show one of some textures each."""
    rng = np.random.default_rng(seed)
    tiles = [texture(k + 1, (PIXELS, PIXELS)) for k in range(kinds)]
    rows = [np.concatenate([tiles[k] for k in rng.integers(kinds, size=TILES)], 1) for _ in range(TILES)]
    return np.concatenate(rows, 0)


def test_ground_that_never_repeats_has_no_lattice():
    found = lattice.measure_lattice(texture(0, (TILES * PIXELS, TILES * PIXELS)), PIXELS)
    assert abs(found.brightness) < 0.02 and abs(found.landmarks) < 0.03
    assert found.mean_tile < 0.02 and found.busyness < 0.01


def test_one_tile_everywhere_is_a_perfect_lattice():
    found = lattice.measure_lattice(tiled(1), PIXELS)
    assert found.brightness > 0.85 and found.landmarks > 0.7
    assert found.mean_tile > 0.95 and found.next > 0.9


def test_more_tiles_repeat_less():
    excess = [lattice.measure_lattice(tiled(kinds), PIXELS).brightness for kinds in (1, 2, 8)]
    assert excess[0] > excess[1] > excess[2] > 0.05


def test_cells_of_unlike_brightness_are_busy():
    picture = texture(0, (TILES * PIXELS, TILES * PIXELS))
    shade = np.random.default_rng(1).normal(0, 0.1, (TILES, TILES)).repeat(PIXELS, 0).repeat(PIXELS, 1)
    assert lattice.measure_lattice(picture + shade[..., None], PIXELS).busyness > 0.3


def test_patches_wider_than_tiles_are_no_lattice():
    patches = gaussian_filter(np.random.default_rng(2).normal(size=(TILES * PIXELS,) * 2), 3 * PIXELS, mode="wrap")
    picture = texture(0, (TILES * PIXELS, TILES * PIXELS)) + 0.2 * (patches > 0)[..., None]
    assert lattice.measure_lattice(picture, PIXELS).brightness < 0.05


@pytest.mark.parametrize("value", [0.0, 0.4])
def test_a_picture_of_one_colour_has_none(value):
    found = lattice.measure_lattice(np.full((TILES * PIXELS, TILES * PIXELS, 3), value), PIXELS)
    assert found == lattice.LatticeMeasures(0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_material_alone_lies_everywhere_without_objects(tmp_path):
    land_covers.write_cover_bundle(tmp_path / "cover", SCHEMA)
    terrain = endless.terrain_from_bundle(store.read_bundle(tmp_path / "cover", SCHEMA), {"kind": "flat"})
    for number, colour in enumerate((land_covers.SAND, land_covers.GRASS)):
        alone = lattice.take_material(terrain, number)
        picture = lattice.render_from_above(alone, 0, tiles=6, pixels=16)
        assert np.abs(picture.mean((0, 1)) - colour).max() < 0.05
        assert (alone.tiles_each, len(alone.tile_orders), alone.scatter) == (16, 16, None)
