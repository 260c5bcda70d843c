"""Objects baked into tiles for the public renderer."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import SIDE, TILES, cover_content, shrub

from dav_gswt.export import gswt


def first(thing):
    """The object on the first material."""
    return replace(thing, material=0)


@pytest.fixture(scope="module")
def content():
    return replace(cover_content(), objects=[first(shrub(0.4, 0.2))])


def bake(content, objects):
    return gswt.bake_objects(content.tiles[0].fields, objects, content.ground_height(0), SIDE, 7)


@pytest.fixture(scope="module")
def baked(content):
    return bake(content, content.objects)


def added(content, baked, tile, level=0):
    return baked[level][tile][len(content.tiles[0].fields[level][tile]) :]


def test_tiles_have_as_many_objects_as_the_density_says(content, baked):
    count = sum(len(added(content, baked, tile)) for tile in range(TILES)) / len(content.objects[0].fields[0])
    mean = 0.2 * SIDE**2 * TILES
    assert abs(count - mean) < 3 * mean**0.5 and count == int(count)


def test_tiles_keep_the_same_mean_height_and_their_borders(content, baked):
    """The public renderer shifts each tile by its own mean height."""
    heights = [float(field.means[:, 2].astype(float).mean()) for field in baked[0]]
    assert np.ptp(heights) < 1e-5 * SIDE
    for before, after in zip(content.tiles[0].fields[0], baked[0], strict=True):
        edge = np.abs(before.means[:, :2] - SIDE / 2).max(1) > 0.49 * SIDE
        np.testing.assert_allclose(after.means[: len(before)][edge], before.means[edge], atol=2e-4)
        middle = after.means[len(before) :, :2]
        assert len(middle) == 0 or np.abs(middle - SIDE / 2).max() <= 0.46 * SIDE


def test_the_public_renderers_checker_finds_no_fault_with_objects(content, gswt_checker, tmp_path):
    fields = bake(content, [first(shrub(0.4, 0.2)), first(shrub(0.2, 0.5))])
    gswt.write_gswt(fields, SIDE, tmp_path / "objects.zip")
    command = [sys.executable, gswt_checker, tmp_path / "objects.zip"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and " 0 faults" in done.stdout, done.stdout + done.stderr


def test_an_object_wider_than_a_tile_is_left_out(content):
    fields = bake(content, [first(shrub(2.5, 0.2))])
    assert [len(f) for f in fields[0]] == [len(f) for f in content.tiles[0].fields[0]]
