"""Walking, orbiting, the map and the tour: keys, mouse, the eye's floor, the link, and what survives a lost context."""

import math

import numpy as np
import pytest
from fixtures.bundles import Ground
from fixtures.page_visit import Visit

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


@pytest.fixture(scope="module")
def moving(chromium, plain):
    """A visit to a page that draws by itself."""
    with chromium.new_context(viewport={"width": 160, "height": 100}) as context:
        yield Visit(context.new_page()).open(plain)


def test_a_walk_changes_the_place_and_coming_back_shows_the_same_picture(moving):
    before = moving.at(**OBLIQUE)
    moving.page.keyboard.down("w")
    moving.until("davgswt.state.x > 3.2")
    moving.page.keyboard.up("w")
    away = moving.state
    # yaw 20 degrees: the walk goes east by cos 20 and north by sin 20 of it
    assert (away["y"] - 5) / (away["x"] - 3) == pytest.approx(0.36397, abs=1e-4)
    assert (moving.picture() != before).any()
    assert (moving.at(**OBLIQUE) == before).all()


@pytest.mark.parametrize(
    "key, condition",
    [
        ("s", "s.x < 2.9 && s.y < 5"),
        ("a", "s.y > 5.1 && s.x < 3"),
        ("d", "s.y < 4.9 && s.x > 3"),
        ("ArrowUp", "s.x > 3.1"),
        ("ArrowLeft", "s.yaw > 22"),
        ("ArrowRight", "s.yaw < 18"),
        ("e", "s.eye > 2.1"),
        ("q", "s.eye < 1.9"),
    ],
)
def test_each_key_does_what_the_help_says(moving, key, condition):
    moving.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    moving.page.keyboard.down(key)
    moving.until(f"(s => {condition})(davgswt.state)")
    moving.page.keyboard.up(key)


@pytest.mark.parametrize(
    "address, place, overlay, paint",
    [
        ("#3,5,2,20,-30&show=level&paint=AbC", dict(x=3, y=5, eye=2, yaw=20, pitch=-30), 2, "AbC"),
        ("#3,5&paint=AbC&show=tile", dict(x=3, y=5), 1, "AbC"),
        ("#one,,NaN,Infinity&show=nothing", {}, 0, ""),
        ("#%2c,%2c&show=%", {}, 0, ""),
        ("#%", {}, 0, ""),
        ("", {}, 0, ""),
    ],
)
def test_an_address_is_a_place_an_overlay_and_paint(call, address, place, overlay, paint):
    found = [call("ui/address.js", f"parse{what}", address) for what in ("Place", "Overlay", "Paint")]
    assert found == [place, overlay, paint]


def test_an_address_tells_a_place_to_a_thousandth(call):
    place = dict(x=3.00012, y=-5, eye=2, yaw=20, pitch=-30.5, floor=0.5, radius=0)
    assert call("ui/address.js", "formatAddress", place, 0, "") == "#3.0001,-5.0000,2.0000,20.000,-30.500"
    coarse = call("ui/address.js", "formatAddress", place | {"floor": 50}, 2, "AbC")
    assert coarse == "#3.00,-5.00,2.00,20.000,-30.500&show=level&paint=AbC"


def test_a_place_that_is_beyond_all_bounds_is_passed_over(still, plain):
    seen = still(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.evaluate("davgswt.set({ x: 1e300, y: -1e300, eye: NaN, yaw: Infinity })")
    assert {key: seen.state[key] for key in OBLIQUE} == OBLIQUE


def test_the_eye_stays_above_its_floor_and_the_wheel_moves_it(still, plain):
    seen, floor = still(plain), Ground().eye_floor
    seen.page.evaluate("davgswt.set({ x: 2, y: 2, eye: -5, yaw: 0, pitch: -20 })")
    assert seen.state["eye"] == floor
    seen.page.mouse.move(80, 20)  # above the tools
    seen.page.mouse.wheel(0, -200)
    assert seen.state["eye"] == floor
    seen.page.mouse.wheel(0, 200)
    seen.until(f"davgswt.state.eye > 1.3 * {floor}")


def test_dragging_turns_the_view_as_if_the_picture_were_held(still, plain):
    seen = still(plain)
    seen.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    seen.page.mouse.move(100, 20)  # above the tools
    seen.page.mouse.down()
    seen.page.mouse.move(140, 40)
    seen.page.mouse.up()
    # 320 pixels are 60 degrees: 40 pixels to the right are 7.5 degrees to the left, 20 down are 3.75 up
    assert (seen.state["yaw"], seen.state["pitch"]) == (pytest.approx(27.5), pytest.approx(-26.25))


def test_the_address_follows_the_walk_and_a_pasted_one_is_followed(moving):
    moving.page.evaluate("place => davgswt.set(place)", OBLIQUE)
    moving.until("location.hash.startsWith('#3.0000,5.0000,2.0000,20.000,-30.000')")
    moving.page.keyboard.press("o")
    moving.until("location.hash.endsWith('&show=tile')")
    moving.page.evaluate("location.hash = '#-7,1.5,1,90,-10&show=level&paint='")
    moving.until("davgswt.state.x === -7 && davgswt.state.yaw === 90 && davgswt.state.overlay === 'level'")
    moving.page.evaluate("location.hash = '#3,5,2,20,-30'")
    moving.until("davgswt.state.x === 3 && davgswt.state.overlay === 'picture'")


@pytest.mark.slow
def test_a_lost_context_comes_back_with_the_same_picture(visit, plain):
    """Also where it goes while a picture is under way."""
    seen = visit().open(f"{plain}?still")
    before = seen.at(**OBLIQUE)
    seen.page.evaluate(
        """() => {
          const gl = document.getElementById("picture").getContext("webgl2");
          window.loss = gl.getExtension("WEBGL_lose_context");
          davgswt.settle();
          loss.loseContext();
        }"""
    )
    error = seen.page.locator("#error")
    error.wait_for(state="visible")
    seen.page.evaluate("loss.restoreContext()")
    error.wait_for(state="hidden")
    assert (seen.picture() == before).all()


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


FLY = """async ([heights, rate, seconds]) => {
  const { createTour } = await import("./ui/tour.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { createWalker } = await import("./ui/walker.js");
  const surface = createHeights(heights);
  const walker = createWalker({ tile_side: 4, eye_floor: 0.5 }, { yaw: 200, pitch: 5 });
  const tour = createTour(), seen = [];
  tour.start(walker, surface);
  for (let k = 0; k < seconds * rate; k++) {
    tour.step(walker, surface, 1 / rate);
    const ground = surface.at(walker.x, walker.y)[0];
    seen.push([walker.x, walker.y, ground + walker.eye, walker.yaw, walker.pitch, ground]);
  }
  return seen;
}"""
HILLS = {"kind": "hills", "height": 2.0, "wavelength": 9.0, "octaves": 3, "salt": 5}


def test_a_tour_is_smooth_and_above_the_ground(modules):
    rate = 60
    x, y, z, yaw, pitch, ground = np.array(modules.evaluate(FLY, [HILLS, rate, 120])).T
    assert (z - ground >= 0.5 - 1e-9).all(), "never below the eye's floor"
    turned = np.unwrap(np.radians(yaw))
    speed = np.hypot(np.diff(x), np.diff(y)) * rate
    assert speed[0] < 0.01, "it begins at rest"
    # units, radians and degrees a second each second: nothing jolts
    assert np.abs(np.diff(speed)).max() * rate < 0.5
    assert np.abs(np.diff(turned, 2)).max() * rate**2 < np.radians(6)
    assert np.abs(np.diff(pitch, 2)).max() * rate**2 < 8
    assert np.abs(np.diff(turned)).max() * rate < np.radians(12)
    assert (np.abs(np.diff(z)) * rate < 1.5).all()
    clear = (z - ground)[10 * rate :]
    assert clear.max() > 2.5 * clear.min(), "it sinks and rises"
    assert np.hypot(x - x[0], y - y[0]).max() > 10, "it goes somewhere"


@pytest.mark.slow
def test_any_input_ends_the_tour(visit, plain):
    seen = visit(480, 300).open(plain)
    inputs = {
        "key": lambda page: page.keyboard.press("ArrowRight"),
        "mouse": lambda page: page.mouse.click(240, 60),
        "wheel": lambda page: page.mouse.wheel(0, 50),
    }
    for name, touch in inputs.items():
        start = seen.state["x"]
        seen.page.keyboard.press("t")
        seen.until(f"davgswt.tour && davgswt.state.x !== {start}")
        touch(seen.page)
        seen.until("!davgswt.tour")
        place = seen.state
        seen.page.wait_for_timeout(100)
        assert seen.state["x"] == place["x"], name
