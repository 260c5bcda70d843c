"""A planet on the page: the library's pictures, no holes, walks over edges and corners, addresses."""

import json
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from fixtures.bundles import SKY, Ground
from fixtures.page_visit import camera_at
from fixtures.terrains import two_level_terrain
from playwright.sync_api import Error

from dav_gswt.bundle.manifest import Manifest, Sky
from dav_gswt.bundle.store import Bundle
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.sphere import make_sphere

GROUND = Ground(levels=3, speckle=40, things=4)
RADII = {"small": 6.0, "large": 1e7}  # tile sides
CORNER = float(np.degrees(np.arctan(np.sqrt(0.5))))  # latitude of the cube's corners
PLACES = {
    "walker": dict(x=20.0, y=30.0, eye=0.8, yaw=60.0, pitch=-12.0),
    "edge": dict(x=45.0, y=3.0, eye=1.5, yaw=200.0, pitch=-35.0),
    "turned edge": dict(x=5.0, y=45.0, eye=1.5, yaw=100.0, pitch=-40.0),
    "corner": dict(x=45.0, y=CORNER, eye=2.0, yaw=10.0, pitch=-80.0),
    "pole": dict(x=0.0, y=90.0, eye=3.0, yaw=10.0, pitch=-60.0),
}
ORBIT = dict(x=41.3, y=23.7, eye=50.0, yaw=30.0, pitch=-89.0)
WALK = """async seconds => {
  const { viewer } = await import("./main.js"), { moveBy } = await import("./ui/walker.js");
  moveBy(viewer.scene.walker, { forward: 1, right: 0, turn: 0, tilt: 0, rise: 0, run: 0 }, seconds);
}"""
STALE = """async place => { // the picture of a place, of the frame of the one before
  const { viewer } = await import("./main.js"), { gl } = viewer;
  viewer.setPlace(place);
  viewer.drawFrame();
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight], bytes = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  return [width, height, btoa(Array.from(bytes, (v) => String.fromCharCode(v)).join(""))];
}"""
MEAN, MOST = 1.0, 40  # of 255; where levels fade blobs differ by up to 38, on purpose, see test_against_library.py
EXACT = 12  # of 255: largest difference where nothing fades; the page rounds at each of some twenty splats of a pixel


@pytest.fixture(scope="module", params=RADII)
def planet(request, page_of):
    """The address of a planet's page, and the library's terrain of the same bundle."""
    with served_planet(page_of, GROUND, RADII[request.param]) as found:
        yield found


@pytest.fixture(scope="module")
def unfading(page_of):
    """The same of a small planet with a single level."""
    with served_planet(page_of, replace(GROUND, levels=1), RADII["small"]) as found:
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
    folder = page_of(Ground(), surface=make_sphere(RADII["small"], GROUND.side))
    manifest = json.loads((folder / "davgswt.json").read_text())
    manifest |= {"ground_colour": [1, 0, 1], "sky": {"zenith": [1, 0, 1], "horizon": [1, 0, 1]}}
    (folder / "davgswt.json").write_text(json.dumps(manifest))
    with served(folder) as address:
        yield address


@pytest.mark.parametrize("place", [pytest.param(place, id=name) for name, place in (PLACES | {"orbit": ORBIT}).items()])
def test_the_page_draws_what_the_library_draws(still, planet, place):
    address, terrain, manifest = planet
    drawn = still(address, 160, 100).at(**place)
    expected = np.rint(255 * stills.render_view(terrain, camera_at(terrain, place), Sky(**SKY), manifest.ground_colour))
    difference = np.abs(drawn - expected)
    assert difference.mean() < MEAN and difference.max() <= MOST
    assert expected.std() > 8, "there is something to see"


@pytest.mark.parametrize("place", [pytest.param(place, id=name) for name, place in (PLACES | {"orbit": ORBIT}).items()])
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


@pytest.mark.parametrize("place", [pytest.param(place, id=name) for name, place in PLACES.items() if name != "walker"])
def test_the_ground_has_no_holes(still, small, place):
    picture = still(small).at(**place | {"pitch": -85.0})
    assert np.clip((picture[..., 2] - 60) / 195, 0, 1).max() < 0.1  # discs are stretched to 1.26 of their distances


def test_a_walk_over_edges_and_corners_has_no_jump(still, small):
    """A hundred steps straight on over a corner: the ground under the eye and the picture change as little as ever."""
    seen = still(small, 160, 100)
    before = seen.at(**PLACES["corner"] | {"x": 35.0, "y": 45.0, "pitch": -60.0, "yaw": -60.0})
    changes, faces = [], set()
    for _ in range(100):
        seen.page.evaluate(WALK, 0.05)
        after = seen.picture()
        faces.add(seen.state["under"]["face"])
        changes.append(np.abs(after - before).mean())
        before = after
    assert len(faces) == 3
    assert max(changes) < 3 * np.median(changes)


def test_while_the_worker_is_behind_its_last_frame_is_drawn_from_where_the_eye_is(still, planet):
    address, terrain, _ = planet
    seen, place = still(address, 160, 100), PLACES["turned edge"]
    old = seen.at(**place)
    there = place | {"y": place["y"] + float(np.degrees(0.2 / terrain.heights.radius))}
    stale = seen.decode(*seen.page.evaluate(STALE, there))
    new = seen.at(**there)
    assert np.abs(old - new).mean() > 1
    assert np.abs(stale - new).mean() < 0.2


def test_one_begins_where_the_still_of_the_walker_was_taken(visit, small):
    state, ball = visit(160, 100).open(f"{small}?still").state, make_sphere(RADII["small"], GROUND.side)
    camera = stills.shot_camera(stills.SHOTS[0], terrain_on(ball), 0.5, 160, 100)
    begin = camera_at(terrain_on(ball), state)
    np.testing.assert_allclose(begin.centre, camera.centre, atol=1e-9)
    np.testing.assert_allclose(begin.rotation, camera.rotation, atol=1e-9)


def terrain_on(ball):
    return replace(two_level_terrain(), heights=ball)


def test_an_address_brings_another_person_to_the_same_place(visit, small):
    first = visit(160, 100).open(f"{small}?still")
    expected = first.at(x=44.9, y=35.2, eye=1.25, yaw=20.0, pitch=-30.0)
    address = first.page.evaluate("import('./main.js').then(({ viewer }) => viewer.address(''))")
    other = visit(160, 100).open(f"{small}?still{address}")
    assert (other.picture() == expected).all()


def test_keys_walk_over_the_pole(visit, small):
    seen = visit(160, 100).open(f"{small}#10,89,0.5,90,-30")
    seen.page.keyboard.down("w")
    seen.until("Math.abs(davgswt.state.x - 10) > 100")
    seen.page.keyboard.up("w")
    state = seen.state
    assert abs((state["x"] - 10) % 360 - 180) < 1e-6 and state["y"] < 90
    assert abs((state["yaw"] + 90) % 360) % 360 == pytest.approx(0, abs=1e-6)


def test_other_pages_are_told_that_it_is_a_planet(still, small):
    with pytest.raises(Error, match="is a planet"):
        still(small, 160, 100).page.evaluate(
            "address => import('./terrain_api.js').then(({ load }) => load(address))", small
        )
