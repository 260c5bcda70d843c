"""The importable terrain (terrain_api.js) in somebody else's page: what it says, draws and refuses."""

import json

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.bundles import Ground, directions, tile_at
from fixtures.page_visit import Visit

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.terrain.heights import Hills

GROUND = Ground(levels=3, speckle=40, things=4)
HILLS = Hills(2.0 * GROUND.side, 12.0 * GROUND.side, 3, 5)
PLACE = dict(x=3.0, y=5.0, eye=0.8, yaw=60.0, pitch=-12.0)
OPEN = """async ([width, height]) => {
  const { load } = await import("./terrain_api.js");
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  window.gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: true });
  window.terrain = await load(".");
  await terrain.loaded;
}"""
GRAB = """async ([place, exact, late]) => {
  const { width, height } = gl.canvas, camera = terrain.camera(place, width, height);
  if (late) await terrain.update(camera);
  window.painter?.end();
  window.painter = terrain.createPainter(gl);
  const update = await terrain.update(camera, { exact });
  painter.draw(camera);
  const bytes = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  return [update, [width, height, btoa(Array.from(bytes, (v) => String.fromCharCode(v)).join(""))]];
}"""


@pytest.fixture(scope="module")
def hilly(page_of):
    """The folder of a page of speckled discs on hills, and its address."""
    folder = page_of(GROUND, surface=HILLS)
    with served(folder) as address:
        yield folder, address


@pytest.fixture(scope="module")
def other(blank, hilly):
    """A page that holds nothing but a canvas, and has loaded the terrain."""
    tab = blank(hilly[1])
    tab.evaluate(OPEN, [160, 100])
    return tab


def test_it_draws_what_the_page_draws_to_the_bit(still, hilly, other):
    expected = still(hilly[1], 160, 100).at(**PLACE)
    assert expected.std() > 8
    for late in (False, True):  # the painter comes first, or the update
        _, picture = other.evaluate(GRAB, [PLACE, True, late])
        assert (Visit.decode(*picture) == expected).all()


def test_it_draws_alike_on_a_context_that_others_have_set_up(still, hilly, other):
    other.evaluate(
        """() => {
          for (const test of [gl.DEPTH_TEST, gl.CULL_FACE, gl.SCISSOR_TEST, gl.STENCIL_TEST]) gl.enable(test);
          gl.cullFace(gl.FRONT_AND_BACK);
          gl.scissor(0, 0, 3, 3);
          gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
          gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
          gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 4096);
          gl.blendEquation(gl.FUNC_SUBTRACT);
          gl.colorMask(false, true, false, true);
        }"""
    )
    _, picture = other.evaluate(GRAB, [PLACE, True, False])
    assert (Visit.decode(*picture) == still(hilly[1], 160, 100).at(**PLACE)).all()


def test_an_update_keeps_its_budget_and_says_which_tiles_levels_and_orders_are_drawn(still, hilly, other):
    update, _ = other.evaluate(GRAB, [PLACE, True, False])
    seen = still(hilly[1], 160, 100)
    seen.at(**PLACE)
    state = seen.state
    assert (update["gaussians"], update["reach"], update["complete"]) == (state["count"], state["reach"], True)
    assert len(update["cells"]) == len(state["drawn"])
    for cell, drawn in zip(update["cells"], state["drawn"], strict=True):
        order = None if drawn["order"] == 255 else drawn["order"]
        wanted = [drawn[key] for key in ("i", "j", "tile", "level", "last")] + [order]
        assert [cell[key] for key in ("i", "j", "tile", "finest", "coarsest", "order")] == wanted
        assert cell["tile"] == tile_at(cell["i"], cell["j"], GROUND.salt)
    assert {cell["order"] for cell in update["cells"]} > {None}
    told = other.evaluate("terrain.update(terrain.camera(" + str(PLACE) + ", 160, 100), { budget: 3000, exact: true })")
    assert 0 < told["gaussians"] <= 3000


def test_height_and_normal_are_those_of_the_library(other):
    points = np.random.default_rng(0).uniform(-200, 200, (50, 2))
    found = other.evaluate(
        "points => points.map(([x, y]) => [terrain.height(x, y), terrain.normal(x, y)])", points.tolist()
    )
    heights, slopes = HILLS.at(*points.T)
    normals = np.concatenate([-slopes, np.ones((50, 1))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.allclose([h for h, _ in found], heights, atol=1e-9)
    assert np.allclose([n for _, n in found], normals, atol=1e-9)


def test_a_ray_meets_the_ground_where_it_lies(other):
    hit = other.evaluate("terrain.pick([3, 5, 30], [0.2, -0.1, -2])")
    x, y, z = hit["point"]
    assert z == pytest.approx(float(HILLS.at(np.array([x]), np.array([y]))[0][0]), abs=1e-9)
    way = np.array(hit["point"]) - [3, 5, 30]
    # hitGround ends within 1e-4 of the distance
    assert np.allclose(
        way / np.linalg.norm(way), np.array([0.2, -0.1, -2]) / np.linalg.norm([0.2, -0.1, -2]), atol=2e-4
    )
    assert hit["distance"] == pytest.approx(np.linalg.norm(way))
    assert (hit["i"], hit["j"]) == (x // GROUND.side, y // GROUND.side)
    assert hit["normal"] == other.evaluate("([x, y]) => terrain.normal(x, y)", [x, y])
    assert other.evaluate("terrain.pick([3, 5, 30], [0, 0, 1])") is None


def test_gaussians_and_orders_are_those_of_the_bundle(hilly, other):
    found = other.evaluate(
        """async () => {
          const list = (values) => Array.from(values), gaussians = await terrain.gaussians(5, 1);
          for (const key of ["centres", "deviations", "turns", "colours"]) gaussians[key] = list(gaussians[key]);
          const orders = await terrain.orders(5, 1);
          return [gaussians, orders.map((order) => ({ ...order, indices: list(order.indices) }))];
        }"""
    )
    gaussians, orders = found
    manifest = Manifest.from_dict(json.loads((hilly[0] / "davgswt.json").read_text()))
    field = Bundle(hilly[0], manifest).chunk(5, 1)
    assert np.allclose(np.reshape(gaussians["centres"], (-1, 3)), field.means, atol=1e-6)
    assert np.allclose(np.reshape(gaussians["deviations"], (-1, 3)), np.exp(field.log_scales), rtol=1e-5)
    ours, theirs = np.reshape(gaussians["turns"], (-1, 4)), field.quats
    assert np.allclose(np.abs((ours * theirs).sum(1)), 1, atol=1e-5)
    for order, number in zip(orders, manifest.tiles[5].orders, strict=True):
        assert order["number"] == number and np.allclose(order["direction"], directions()[number])
        depths = (field.means @ directions()[number])[order["indices"]]
        assert sorted(order["indices"]) == list(range(len(field)))
        assert np.diff(depths).max() < 1e-5, "back to front"


@pytest.mark.parametrize(
    "call, said",
    [
        ("terrain.height(NaN, 0)", "x, y: not 2 finite numbers"),
        ("terrain.pick([0, 0, 1], [0, 0, 0])", "direction has no length"),
        ("terrain.pick([0, 0, 1], [0, 0, -1], Infinity)", "farthest: not a finite number"),
        ("terrain.update(terrain.camera({ x: 0, y: 0, eye: 1, yaw: 0, pitch: 0 }, 9, 9), { budget: 0 })", "budget"),
        ("terrain.gaussians(99, 0)", "tile: 99 is not 0 to 15"),
        ("terrain.orders(0, 3)", "level: 3 is not 0 to 2"),
        ("import('./terrain_api.js').then(({ load }) => load('nowhere'))", "davgswt.json is not there"),
        ("import('./terrain_api.js').then(({ load }) => load(new Blob(['x'])))", "The zip cannot be read"),
    ],
)
def test_what_makes_no_sense_is_refused_in_words(other, call, said):
    message = other.evaluate(f"(async () => {call})().then(() => null, (error) => error.message)")
    assert message is not None and said in message
