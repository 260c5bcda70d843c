"""Ways to go beside walking: orbiting and the map."""

import math

import pytest

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
ORBIT = """async ([place, turns, factor]) => {
  // where the eye is at first, after turns and after a zoom, over level ground
  const { createOrbit } = await import("./ui/controls.js");
  const { createWalker } = await import("./ui/walker.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { createHeights } = await import("./terrain/heights.js");
  const manifest = { tile_side: 4, eye_floor: 0.01 }, heights = createHeights(), seen = [];
  const walker = createWalker(manifest, place), scene = { walker, heights, manifest, lift: 0 };
  const orbit = createOrbit({ scene, camera: () => cameraAt(walker, 320, 200, heights) });
  const note = () => seen.push({ x: walker.x, y: walker.y, eye: walker.eye, yaw: walker.yaw, pitch: walker.pitch });
  note();
  for (const [turn, tilt] of turns) {
    orbit.turn(turn, tilt);
    note();
  }
  orbit.zoom(factor);
  note();
  return seen;
}"""


def pivot_of(place):
    """Where the middle of the picture meets level ground."""
    far = place["eye"] / math.tan(math.radians(-place["pitch"]))
    yaw = math.radians(place["yaw"])
    return place["x"] + far * math.cos(yaw), place["y"] + far * math.sin(yaw)


def distance_of(place):
    return place["eye"] / math.sin(math.radians(-place["pitch"]))


def test_orbiting_keeps_what_one_looks_at_and_zooming_nears_it(modules):
    start, turned, steep, flat, near = modules.evaluate(ORBIT, [OBLIQUE, [[40, -10], [-90, -80], [0, 120]], 0.5])
    angles = [place[key] for place in (start, turned, steep, flat, near) for key in ("yaw", "pitch")]
    assert angles == pytest.approx([20, -30, 60, -40, 330, -89, 330, -4, 330, -4], abs=1e-6)
    for place in (turned, steep, flat, near):
        assert pivot_of(place) == pytest.approx(pivot_of(start), abs=0.01)
        assert distance_of(place) == pytest.approx((4.0, 2.0)[place is near], rel=1e-3)


def test_orbiting_in_the_sky_turns_about_a_place_ahead(modules):
    up, turned, _ = modules.evaluate(ORBIT, [OBLIQUE | {"pitch": 10}, [[180, 0]], 1])
    # about a place four tile sides ahead: on its other side
    far = 2 * 16 * math.cos(math.radians(10))
    assert turned["x"] - up["x"] == pytest.approx(far * math.cos(math.radians(20)), abs=1e-6)
    assert (turned["yaw"], turned["eye"]) == (pytest.approx(200), pytest.approx(2))


@pytest.mark.slow
def test_the_map_takes_one_elsewhere(visit, plain):
    seen = visit(640, 400).open(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.keyboard.press("n")
    box = seen.page.locator("#map").bounding_box()
    # two of nine tiles (4 units each) to the east of the middle, one to the north
    seen.page.mouse.click(box["x"] + (0.5 + 2 / 9) * box["width"], box["y"] + (0.5 - 1 / 9) * box["height"])
    seen.until("davgswt.state.x !== 3")
    now = seen.state
    assert (now["x"], now["y"]) == (pytest.approx(11, abs=0.3), pytest.approx(9, abs=0.3))
