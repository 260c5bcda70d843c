"""Ways to go beside walking: flying, orbiting, a gamepad, and the map."""

import math

import pytest

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
PAD = """window.pad = {
  connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ value: 0 })),
};
navigator.getGamepads = () => [null, window.pad];"""
ORBIT = """async ([place, turns, factor]) => {
  // where the eye is at first, after turns and after a zoom, over level ground
  const { createOrbit } = await import("./ui/orbit.js");
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


@pytest.fixture
def moving(visit, plain):
    seen = visit(320, 200).open(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    return seen


@pytest.mark.slow
def test_dragging_and_the_wheel_orbit(moving):
    for _ in range(2):
        moving.page.keyboard.press("v")
    before = moving.state
    moving.page.mouse.move(160, 60)
    moving.page.mouse.down()
    moving.page.mouse.move(220, 70, steps=4)
    moving.page.mouse.up()
    now = moving.state
    # 60 of 320 pixels are 33.75 of 180 degrees, 10 pixels 5.625
    assert now["yaw"] == pytest.approx((before["yaw"] - 33.75) % 360)
    assert now["pitch"] == pytest.approx(before["pitch"] - 5.625)
    assert pivot_of(now) == pytest.approx(pivot_of(before), abs=0.02)
    moving.page.mouse.wheel(0, 200)
    moving.until(f"davgswt.state.eye > {1.3 * now['eye']}")


@pytest.mark.slow
def test_a_gamepad_walks_looks_and_rises(visit, plain):
    seen = visit(320, 200)
    seen.page.add_init_script(PAD)
    seen.open(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.evaluate("dispatchEvent(new Event('gamepadconnected'))")
    seen.page.wait_for_timeout(100)
    assert seen.state["x"] == 3, "sticks at rest move nobody"
    seen.page.evaluate("pad.axes = [0.1, -1, 0, 0]")
    seen.until("davgswt.state.x > 3.3 && davgswt.state.y > 5.1")
    seen.page.evaluate("pad.axes = [0, 0, 1, 1]")
    seen.until("davgswt.state.yaw < 15 && davgswt.state.pitch < -33")
    seen.page.evaluate("pad.axes = [0, 0, 0, 0]; pad.buttons[7].value = 1")
    seen.until("davgswt.state.eye > 2.3")
    seen.page.evaluate("pad.buttons[7].value = 0; pad.mapping = ''; pad.axes = [0, 0, -1, 1]")
    before = seen.state
    seen.page.wait_for_timeout(100)
    assert seen.state["yaw"] == before["yaw"], "triggers of an unknown layout may rest at -1"


@pytest.mark.slow
def test_the_map_shows_where_one_is_and_takes_one_elsewhere(visit, plain):
    seen = visit(640, 400).open(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    assert not seen.page.locator("#map").is_visible()
    seen.page.keyboard.press("n")
    assert "a place of a tile, 4 m wide" in seen.page.locator("#toast").inner_text()
    box = seen.page.locator("#map").bounding_box()
    paper = "[...map.getContext('2d').getImageData(0, 0, 220, 220).data].filter((v, k) => k % 4 < 3 && v > 200).length"
    assert seen.page.evaluate(paper) > 200, "numbers and an arrow are drawn"
    # two of nine tiles (4 units each) to the east of the middle, one to the north
    seen.page.mouse.click(box["x"] + (0.5 + 2 / 9) * box["width"], box["y"] + (0.5 - 1 / 9) * box["height"])
    seen.until("davgswt.state.x !== 3")
    now = seen.state
    assert (now["x"], now["y"]) == (pytest.approx(11, abs=0.3), pytest.approx(9, abs=0.3))
    seen.page.keyboard.press("Escape")
    assert not seen.page.locator("#map").is_visible()
