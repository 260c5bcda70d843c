"""A planet on the page: the library's pictures, no holes, and an address that leads back."""

import json
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.bundles import SKY, Ground
from fixtures.page_visit import camera_at
from fixtures.terrains import two_level_terrain

from dav_gswt.bundle.manifest import Manifest, Sky
from dav_gswt.bundle.store import Bundle
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.heights import make_sphere

GROUND = Ground(levels=3, speckle=40, things=4)
SMALL = 6.0  # radius in tile sides
CORNER = float(np.degrees(np.arctan(np.sqrt(0.5))))  # latitude of the cube's corners
PLACES = {
    "edge": dict(x=45.0, y=3.0, eye=1.5, yaw=200.0, pitch=-35.0),
    "turned edge": dict(x=5.0, y=45.0, eye=1.5, yaw=100.0, pitch=-40.0),
    "corner": dict(x=45.0, y=CORNER, eye=2.0, yaw=10.0, pitch=-80.0),
    "pole": dict(x=0.0, y=90.0, eye=3.0, yaw=10.0, pitch=-60.0),
    "orbit": dict(x=41.3, y=23.7, eye=50.0, yaw=30.0, pitch=-89.0),
}
EXACT = 12  # of 255: largest difference where nothing fades; the page rounds at each of some twenty splats of a pixel


@pytest.fixture(scope="module")
def unfading(page_of):
    """The address of the page of a small planet with a single level, and the library's terrain of the same bundle."""
    with served_planet(page_of, replace(GROUND, levels=1), SMALL) as found:
        yield found


@contextmanager
def served_planet(page_of, ground, radius):
    surface = make_sphere(radius, ground.side)
    folder = page_of(ground, surface=surface)
    bundle = Bundle(folder, Manifest.from_dict(json.loads((folder / "davgswt.json").read_text())))
    terrain = replace(endless.terrain_from_bundle(bundle, {"kind": "flat"}), heights=surface)
    with served(folder) as address:
        yield address, terrain, bundle.manifest


@pytest.fixture(scope="module")
def small(page_of):
    """The address of a small planet whose far ground and sky are magenta: it shines through every hole."""
    surface = make_sphere(SMALL, GROUND.side)
    edit = {"ground_colour": [1, 0, 1], "sky": {"zenith": [1, 0, 1], "horizon": [1, 0, 1]}}
    with served(page_of(Ground(), surface=surface, edit=lambda manifest: manifest.update(edit))) as address:
        yield address


@pytest.mark.parametrize("place", [pytest.param(place, id=name) for name, place in PLACES.items()])
def test_without_fades_pictures_are_the_same_but_for_rounding(still, unfading, place):
    """But for pixels at the rim, where rounding may show the sky instead of the ground."""
    address, terrain, manifest = unfading
    drawn, camera = still(address, 160, 100).at(**place), camera_at(terrain, place)
    expected = np.rint(255 * stills.render_view(terrain, camera, Sky(**SKY), manifest.ground_colour))
    way = camera.rays()[1] / np.linalg.norm(camera.rays()[1], axis=-1, keepdims=True)
    passing = np.linalg.norm(np.cross(way, camera.centre), axis=-1) / terrain.heights.radius
    rim = np.abs(passing - 1) < 0.03
    assert np.abs(drawn - expected)[~rim].max() <= EXACT
    assert (np.abs(drawn - expected).max(-1) > EXACT).mean() < 0.001


@pytest.mark.slow
def test_one_begins_where_the_still_of_the_walker_was_taken_and_an_address_leads_back(visit, small):
    first, ground = visit(160, 100).open(f"{small}?still"), make_sphere(SMALL, GROUND.side)
    terrain = replace(two_level_terrain(), heights=ground)
    camera = stills.shot_camera(stills.SHOTS[0], terrain, 0.5, 160, 100)
    begin = camera_at(terrain, first.state)
    np.testing.assert_allclose(begin.centre, camera.centre, atol=1e-9)
    np.testing.assert_allclose(begin.rotation, camera.rotation, atol=1e-9)
    expected = first.at(x=44.9, y=35.2, eye=1.25, yaw=20.0, pitch=-30.0)
    address = first.page.evaluate("import('./main.js').then(({ viewer }) => viewer.address(''))")
    other = visit(160, 100).open(f"{small}?still{address}")
    assert (other.picture() == expected).all()
