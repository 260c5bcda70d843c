"""The page's pictures beside the library's: on level ground, and on hills and a height map below a low sun, of one
material and of two, whose colours vary.

They may differ by what is done differently on purpose: the page fades a level on each pixel's alpha, the library on the
Gaussian's peak; the page blends in 8 bits, so each of the splats that cover a pixel rounds by half a step.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.bundles import Ground, write_bundle
from fixtures.land_covers import SIDE, write_cover_bundle
from fixtures.page_visit import VIEWER, camera_at

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.terrain import endless, stills, visibility
from dav_gswt.terrain.heights import FlatSurface, HeightMap, Hills
from dav_gswt.terrain.light import light_of
from dav_gswt.terrain.page import write_page

HILLS = Hills(1.5 * SIDE, 12.0 * SIDE, 3, 5)
RELIEF = HeightMap(np.random.default_rng(1).uniform(0, 3, (9, 7)).astype(np.float32), 60.0)
TERRAINS = {  # surface, and whether there are two materials with objects
    "flat": (FlatSurface(), False),
    "hills": (HILLS, False),
    "image": (RELIEF, False),
    "flat, two materials": (FlatSurface(), True),
    "hills, two materials": (HILLS, True),
}
PLACES = {
    "walker": dict(x=3.0, y=5.0, eye=0.8, yaw=60.0, pitch=-12.0),
    "oblique": dict(x=-13.0, y=7.5, eye=3.0, yaw=200.0, pitch=-35.0),
    "above": dict(x=6.2, y=1.1, eye=9.0, yaw=77.0, pitch=-80.0),
    "above objects": dict(x=14.0, y=6.5, eye=8.0, yaw=77.0, pitch=-80.0),
    "far from the origin": dict(x=-40_003.0, y=25_001.0, eye=2.0, yaw=-30.0, pitch=-20.0),
}
ONLY_COVERED = {"above objects", "far from the origin"}
CASES = [
    (name, place)
    for name, (_, covered) in TERRAINS.items()
    for place in PLACES
    if (place != "above" if covered else place not in ONLY_COVERED)
]
WAVES = [
    {"wavelength": 0.63, "colours": [[0.3, 0.3, 0.2], [0.1, 0.4, -0.2]]},
    {"wavelength": 1.57, "colours": [[0.2, 0.1, 0.1], [0.3, 0.2, 0.5]]},
]
LIGHT = {"elevation": 12.0, "azimuth": 130.0, "source": "config"}
MEAN, MOST = 1.0, 40  # of 255: mean and largest difference; single pixels where levels fade differ by up to 33


@pytest.fixture(scope="module")
def pair(request, tmp_path_factory):
    """The address of a page, and the library's terrain of the same bundle."""
    folder, (surface, covered) = tmp_path_factory.mktemp("page"), TERRAINS[request.param]
    if covered:
        write_cover_bundle(folder / "bundle")
    else:
        write_bundle(folder / "bundle", Ground(levels=3, speckle=40, things=4))
    write_page(folder / "bundle", VIEWER, folder / "page", surface)
    value = json.loads((folder / "page/davgswt.json").read_text()) | ({"variation": WAVES} if covered else {})
    value |= {} if isinstance(surface, FlatSurface) else {"light": LIGHT}
    (folder / "page/davgswt.json").write_text(json.dumps(value))
    manifest = Manifest.from_dict(value)
    terrain = replace(endless.terrain_from_bundle(Bundle(folder / "page", manifest), {"kind": "flat"}), heights=surface)
    if covered:
        classes = replace(terrain.classes, heights=surface)
        terrain = replace(terrain, classes=classes, scatter=replace(terrain.scatter, classes=classes))
    with served(folder / "page") as address:
        yield address, terrain, manifest


def assert_alike(still, pair, place: dict) -> None:
    address, terrain, manifest = pair
    camera = camera_at(terrain, place)
    if terrain.classes:
        cells = visibility.visible_cells(terrain, camera)
        assert 3 in cells.materials and len(terrain.scatter.instances_in(cells.i, cells.j)) > 2
    drawn = still(address, 160, 100).at(**place)
    light = light_of(manifest)
    expected = np.rint(255 * stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour, light=light))
    difference = np.abs(drawn - expected)
    assert difference.mean() < MEAN and difference.max() <= MOST
    assert expected.std() > 8, "there is something to see"


@pytest.mark.parametrize("pair", ["image", "hills, two materials"], indirect=True)
def test_the_page_draws_what_the_library_draws_from_an_oblique_eye(still, pair):
    assert_alike(still, pair, PLACES["oblique"])


@pytest.mark.parametrize("pair", ["hills"], indirect=True)
@pytest.mark.parametrize("yaw", [100.0, 280.0])
def test_the_page_draws_the_library_s_hills_up_to_the_horizon(still, pair, yaw):
    address, terrain, manifest = pair
    place = dict(x=3.0, y=5.0, eye=12.0, yaw=yaw, pitch=4.0)
    drawn = still(address, 160, 100).at(**place) / 255
    camera, light = camera_at(terrain, place), light_of(manifest)
    expected = stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour, light=light)
    error = ((drawn - expected) ** 2).mean((1, 2))
    ends = terrain.reach * SIDE
    fall = np.degrees(np.arctan((place["eye"] + 2 * HILLS.height) / ends))  # lower, all is nearer than the last tiles
    far = error[: int(50 + 138.6 * np.tan(np.radians(4 + fall)))]
    assert -10 * np.log10(far.mean()) > 38, "pixels at silhouettes differ"


@pytest.mark.slow
@pytest.mark.parametrize("pair, place", CASES, indirect=["pair"])
def test_the_page_draws_what_the_library_draws(still, pair, place):
    assert_alike(still, pair, PLACES[place])
