"""Ways to go beside walking: flying, orbiting, a gamepad, and the map."""

import math

import pytest

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)
PAD = """window.pad = {
  connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ value: 0 })),
};
navigator.getGamepads = () => [null, window.pad];"""


def pivot_of(place):
    """Where the middle of the picture meets level ground."""
    far = place["eye"] / math.tan(math.radians(-place["pitch"]))
    yaw = math.radians(place["yaw"])
    return place["x"] + far * math.cos(yaw), place["y"] + far * math.sin(yaw)


@pytest.fixture
def moving(visit, plain):
    seen = visit(320, 200).open(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    return seen


def test_flying_goes_where_one_looks(moving):
    moving.page.keyboard.press("v")
    moving.page.evaluate("davgswt.set({ pitch: 30 })")
    moving.page.keyboard.down("w")
    moving.until("davgswt.state.x > 3.3")
    moving.page.keyboard.up("w")
    moving.page.wait_for_timeout(100)
    now = moving.state
    away = math.hypot(now["x"] - 3, now["y"] - 5)
    assert (now["eye"] - 2) / away == pytest.approx(math.tan(math.radians(30)), rel=1e-3)


def test_orbiting_keeps_what_one_looks_at_and_the_distance(moving):
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
    assert pivot_of(moving.state) == pytest.approx(pivot_of(before), abs=0.05)


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


def test_the_map_shows_where_one_is_and_takes_one_elsewhere(moving):
    assert not moving.page.locator("#map").is_visible()
    moving.page.keyboard.press("n")
    box = moving.page.locator("#map").bounding_box()
    paper = "[...map.getContext('2d').getImageData(0, 0, 220, 220).data].filter((v, k) => k % 4 < 3 && v > 200).length"
    assert moving.page.evaluate(paper) > 200, "numbers and an arrow are drawn"
    # two of nine tiles (4 units each) to the east of the middle, one to the north
    moving.page.mouse.click(box["x"] + (0.5 + 2 / 9) * box["width"], box["y"] + (0.5 - 1 / 9) * box["height"])
    moving.until("davgswt.state.x !== 3")
    now = moving.state
    assert (now["x"], now["y"]) == (pytest.approx(11, abs=0.3), pytest.approx(9, abs=0.3))


def test_the_menu_says_which_way_one_goes(moving):
    moving.page.locator("#menuButton").click()
    moving.page.get_by_label("Fly").check()
    assert moving.page.evaluate("davgswt.state.mode") == "fly"
    moving.page.locator("#menuClose").click()
    assert moving.page.evaluate("document.activeElement.id") == "menuButton"
    moving.page.keyboard.press("v")  # a button has no use for letters
    assert moving.page.evaluate("davgswt.state.mode") == "orbit"
    assert moving.page.locator("#modes input:checked").get_attribute("value") == "orbit"


def test_who_walks_again_stands_on_the_ground(moving):
    moving.page.keyboard.press("v")
    moving.page.evaluate("davgswt.set({ eye: 6 })")
    assert moving.state["eye"] == 6
    for _ in range(2):
        moving.page.keyboard.press("v")
    assert (moving.state["mode"], moving.state["eye"]) == ("walk", moving.page.evaluate("davgswt.walker.floor"))


def test_the_map_says_what_it_shows_and_its_scale_when_it_opens(visit, plain):
    seen = visit(640, 400).open(plain)
    seen.page.keyboard.press("n")
    assert "a place of a tile, 4 m wide" in seen.page.locator("#toast").inner_text()


def test_escape_closes_the_map(moving):
    moving.page.keyboard.press("n")
    assert moving.page.locator("#map").is_visible()
    moving.page.keyboard.press("Escape")
    assert not moving.page.locator("#map").is_visible()
