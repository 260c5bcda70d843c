"""Pieces of finished terrains: a page folder as a terrain in Python, and its surface."""

import hashlib

import numpy as np
import pytest
from fixtures.finite_cells import collect_cells
from fixtures.land_covers import SIDE, write_cover_bundle

from dav_gswt.bundle import store
from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render
from dav_gswt.terrain import endless, heights, stills
from dav_gswt.terrain.heights import FlatSurface, HeightMap, Hills, make_sphere
from dav_gswt.terrain.page import write_page

SURFACES = {
    "flat": FlatSurface(),
    "hills": Hills(2.0, 30.0),
    "image": HeightMap(np.random.default_rng(1).uniform(0, 3, (9, 7)).astype(np.float32), 60.0),
}
HILLS = {"kind": "hills", "height": 0.4, "wavelength": 4}
NOT_FINITE = np.full((9, 7), np.nan, np.float32).tobytes()
RULE = [{"kind": "noise"}, {"kind": "height", "material": "grass", "low": 0.1, "soft": 0.2}]


def test_a_page_is_the_terrain_that_it_was_made_of(root, tmp_path):
    write_cover_bundle(tmp_path / "bundle")
    write_page(tmp_path / "bundle", root / "workflow/viewer", tmp_path / "page", SURFACES["hills"], RULE)
    terrain = endless.terrain_from_page(store.read_bundle(tmp_path / "page"))
    surface = {"kind": "hills", "height": 2 / SIDE, "wavelength": 30 / SIDE}
    wanted = endless.terrain_from_bundle(store.read_bundle(tmp_path / "bundle"), surface, RULE)
    assert terrain.heights == wanted.heights == SURFACES["hills"]
    points = np.random.default_rng(3).integers(-60, 60, (2, 200))
    np.testing.assert_array_equal(terrain.classes.lattice_scores(*points), wanted.classes.lattice_scores(*points))
    assert terrain.side == wanted.side and len(terrain.objects) == len(wanted.objects) == 1


@pytest.mark.parametrize("surface", [*SURFACES.values(), make_sphere(10.0, 4.0)], ids=[*SURFACES, "sphere"])
def test_a_surface_that_was_described_reads_back(tmp_path, surface):
    entry, pixels = surface.describe()
    (tmp_path / "heights.bin").write_bytes(pixels)
    found = heights.read_surface(tmp_path, entry, 4.0)
    assert vars(found).keys() == vars(surface).keys()
    for name, value in vars(surface).items():
        np.testing.assert_array_equal(getattr(found, name), value)


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"rows": 10}, "bytes where the manifest says"),
        ({"rows": 0}, "a size is out of range"),
        ({"rows": "many"}, "make no sense"),
        ({"file": "../heights.bin"}, "lies outside"),
        ({"file": "nowhere.bin"}, "not readable"),
        ({"file": "nan.bin", "sha256": hashlib.sha256(NOT_FINITE).hexdigest()}, "not finite"),
        ({"sha256": "0" * 64}, "its digest is not"),
    ],
)
def test_a_surface_that_is_damaged_is_named(tmp_path, changes, said):
    entry, pixels = SURFACES["image"].describe()
    (tmp_path / "heights.bin").write_bytes(pixels)
    (tmp_path / "nan.bin").write_bytes(NOT_FINITE)
    with pytest.raises(InputError, match=said):
        heights.read_surface(tmp_path, entry | changes, 4.0)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cover") / "b"
    write_cover_bundle(folder)
    return store.read_bundle(folder)


@pytest.mark.parametrize("surface, corner", [({"kind": "flat"}, (0, 0)), (HILLS, (4000, -7000))], ids=["flat", "hills"])
def test_it_looks_as_the_terrain_does(bundle, surface, corner):
    terrain = endless.terrain_from_bundle(bundle, surface)
    west, south = corner
    field = collect_cells(terrain, west - 4, south - 4, 9, 9, 0)
    x, y = (west + 0.5) * SIDE, (south + 0.5) * SIDE
    ground = float(terrain.heights.at(np.array([x]), np.array([y]))[0][0])
    eye = np.array([x, y, ground + 2 * SIDE])
    camera = cameras.pinhole(eye, eye + [0.3, 0.2, -1.0], 96, 96, 40.0)
    expected = stills.render_view(terrain, camera, bundle.manifest.sky, bundle.manifest.ground_colour)
    origin = np.array([(west - 4) * SIDE, (south - 4) * SIDE, 0.0])
    near = cameras.pinhole(eye - origin, eye - origin + [0.3, 0.2, -1.0], 96, 96, 40.0)
    assert psnr(render(field, near).colour, expected, np.ones((96, 96))) > 35
    assert np.abs(field.means[:, :2]).max() < 10 * SIDE, "positions count from the corner"
