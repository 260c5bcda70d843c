"""The page's pictures beside the library's, on level ground, on hills and on a height map.

They may differ by what is done differently on purpose: the page fades a level on each pixel's alpha, the library on the
Gaussian's peak; the page blends in 8 bits, so each of the splats that cover a pixel rounds by half a step.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures.bundles import SKY, Ground
from fixtures.page_visit import camera_at

from dav_gswt.bundle.manifest import Manifest, Sky
from dav_gswt.bundle.store import Bundle
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.heights import FlatSurface, HeightMap, Hills

GROUND = Ground(levels=3, speckle=40, things=4)
SURFACES = {
    "flat": FlatSurface(),
    "hills": Hills(2.0 * GROUND.side, 12.0 * GROUND.side, 3, 5),
    "image": HeightMap(np.random.default_rng(1).uniform(0, 3, (9, 7)).astype(np.float32), 60.0),
}
PLACES = {
    "walker": dict(x=3.0, y=5.0, eye=0.8, yaw=60.0, pitch=-12.0),
    "oblique": dict(x=-13.0, y=7.5, eye=3.0, yaw=200.0, pitch=-35.0),
    "above": dict(x=6.2, y=1.1, eye=9.0, yaw=77.0, pitch=-80.0),
}
MEAN, MOST = 1.0, 32  # of 255: mean and largest difference that is allowed


@pytest.fixture(scope="module", params=SURFACES)
def hilly(request, page_of):
    """The address of a page over a surface, and the library's terrain of the same bundle."""
    surface = SURFACES[request.param]
    folder = page_of(GROUND, surface=surface)
    with served(folder) as address:
        yield address, terrain_of(folder, surface)


def terrain_of(folder, surface) -> tuple[EndlessTerrain, dict]:
    bundle = Bundle(folder, Manifest.from_dict(json.loads((folder / "davgswt.json").read_text())))
    return replace(endless.terrain_from_bundle(bundle, {"kind": "flat"}), heights=surface), bundle.manifest


@pytest.mark.parametrize("place", [pytest.param(place, id=name) for name, place in PLACES.items()])
def test_the_page_draws_what_the_library_draws(still, hilly, place):
    address, (terrain, manifest) = hilly
    seen = still(address, 160, 100)
    drawn = seen.at(**place)
    expected = np.rint(255 * stills.render_view(terrain, camera_at(terrain, place), Sky(**SKY), manifest.ground_colour))
    difference = np.abs(drawn - expected)
    assert difference.mean() < MEAN and difference.max() <= MOST
    assert expected.std() > 8, "there is something to see"
