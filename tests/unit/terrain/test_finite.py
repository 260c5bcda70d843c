"""A finite piece of the terrain against what the terrain's own renderer draws."""

import numpy as np
import pytest
from fixtures.land_covers import SIDE, write_cover_bundle

from dav_gswt.bundle import store
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render
from dav_gswt.terrain import classes, endless, finite, scatter, stills

HILLS = {"kind": "hills", "height": 0.4, "wavelength": 4}


@pytest.fixture(scope="module")
def bundle(tmp_path_factory, root):
    folder, schema = tmp_path_factory.mktemp("cover") / "b", root / "workflow/schemas/davgswt.schema.json"
    write_cover_bundle(folder, schema)
    return store.read_bundle(folder, schema)


@pytest.mark.parametrize("surface", [{"kind": "flat"}, HILLS])
@pytest.mark.parametrize("corner", [(0, 0), (4000, -7000)])
def test_it_looks_as_the_terrain_does(bundle, surface, corner):
    terrain = endless.terrain_from_bundle(bundle, surface)
    west, south = corner
    field = finite.collect_cells(terrain, west - 4, south - 4, 9, 9, 0)
    x, y = (west + 0.5) * SIDE, (south + 0.5) * SIDE
    ground = float(terrain.heights.at(np.array([x]), np.array([y]))[0][0])
    eye = np.array([x, y, ground + 2 * SIDE])
    camera = cameras.pinhole(eye, eye + [0.3, 0.2, -1.0], 160, 160, 40.0)
    expected = stills.render_view(terrain, camera, bundle.manifest.sky, bundle.manifest.ground_colour)
    origin = np.array([(west - 4) * SIDE, (south - 4) * SIDE, 0.0])
    near = cameras.pinhole(eye - origin, eye - origin + [0.3, 0.2, -1.0], 160, 160, 40.0)
    assert psnr(render(field, near).colour, expected, np.ones((160, 160))) > 35


def test_every_object_is_there_once(bundle):
    terrain = endless.terrain_from_bundle(bundle, {"kind": "flat"})
    whole = finite.collect_cells(terrain, 0, 0, 6, 6, 1)
    parts = [finite.collect_cells(terrain, i, j, 3, 3, 1) for i in (0, 3) for j in (0, 3)]
    assert len(whole) == sum(len(part) for part in parts)
    i, j, _, _ = finite.list_cells(terrain, 0, 0, 6, 6)
    assert len(terrain.scatter.instances_in(i, j)) > 0


def test_positions_far_out_are_as_near(bundle):
    terrain = endless.terrain_from_bundle(bundle, {"kind": "flat"})
    field = finite.collect_cells(terrain, 10**6, -(10**6), 2, 2, 0)
    assert np.abs(field.means).max() < 3 * SIDE and np.isfinite(field.means).all()


def test_a_wide_area_is_counted_in_slices(bundle, monkeypatch):
    """The same counts and blocks, while no more cells are known at a time than a slice has."""
    area, eye = finite.Area(-7, 3, 12, 11), np.array([0.0, 0.0, 2.0])
    whole = endless.terrain_from_bundle(bundle, HILLS)
    counts = finite.count_gaussians(whole, finite.list_grid(whole, area, eye))
    monkeypatch.setattr(finite, "SLICE", 20)
    monkeypatch.setattr(classes, "SLICE", 20)
    monkeypatch.setattr(classes, "CACHED", 40)
    monkeypatch.setattr(scatter, "CACHED", 40)
    sliced = endless.terrain_from_bundle(bundle, HILLS)
    np.testing.assert_array_equal(finite.count_cells(sliced, area, eye), counts)
    assert len(sliced.classes._known) <= 40 and len(sliced.scatter._known) <= 40
    blocks = finite.list_blocks(sliced, area, eye)
    assert sum(map(len, blocks)) == len(counts) and len(sliced.scatter._known) <= 40
