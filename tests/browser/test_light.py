"""Light of the place: the numbers shared with the library, and a sun that the slider, a key and the address move."""

import json
from pathlib import Path

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.bundles import Ground
from fixtures.page_visit import Visit
from fixtures.shader_functions import OPEN_SHADER

from dav_gswt.terrain.heights import Hills

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "light.json").read_text())
GROUND = Ground(speckle=40, things=4)
HILLS = Hills(3.0 * GROUND.side, 12.0 * GROUND.side, 3, 5)
LIGHT = {"elevation": 40.0, "azimuth": 200.0, "source": "assumed"}
PLACE = dict(x=3.0, y=5.0, eye=2.0, yaw=60.0, pitch=-12.0)
NORTH, UP, EAST = np.cos(np.radians(20)), np.tan(np.radians(40)), np.sin(np.radians(200))  # over cos 40
CAPTURED = 6 + np.degrees(np.arctan2(np.hypot(NORTH, UP), EAST)) / 15  # hours

BELOW = """async (cases) => {
  const { createSky } = await import("./draw/sky.js");
  const { findHour, lightBelow, placeSun, sunAt } = await import("./terrain/light.js");
  const gl = new OffscreenCanvas(1, 1).getContext("webgl2"), bytes = new Uint8Array(4);
  return cases.map(({ captured: [elevation, azimuth], north, hour, zenith, horizon, colours, rays }) => {
    const captured = placeSun(elevation, azimuth), manifest = { sky: { zenith, horizon }, ground_colour: [0, 0, 0] };
    const light = lightBelow(manifest, captured, sunAt(captured, hour, north));
    const sky = createSky(gl, { ...manifest, light: {} });
    const shown = rays.map((ahead, k) => { // a picture of one pixel, which sees along the ray
      const [zenith, horizon, ground] = [colours[k], colours[k], colours[k]];
      const camera = { ahead, right: [0, 0, 0], up: [0, 0, 0], width: 1, height: 1, focal: 1 };
      sky.draw(camera, { low: 0.1, light: { ...light, zenith, horizon, ground } });
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      return [...bytes.subarray(0, 3)].map(v => v / 255);
    });
    return { ...light, shown, captured_hour: findHour(captured, north), sun: [light.sun.elevation, light.sun.azimuth],
      new_zenith: light.zenith, new_horizon: light.horizon, sun_colour: light.sunColour };
  });
}"""

SHADED = (
    """async ({ lights, shadows: { sun: [elevation, azimuth], hills, side, eye, points } }) => {"""
    + OPEN_SHADER
    + """
  // the shader's functions, run by transform feedback: of light, and of the texture of shadows
  const { createShadowTexture, lightCode, shineCode } = await import("./draw/lighting.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { createShadows, placeSun } = await import("./terrain/light.js");
  const vertex = `#version 300 es
    ${shineCode(true)}
    ${lightCode("hills")}
    uniform vec3 given;
    out vec4 found;
    void main() { found = vec4(shineOn(given.xy, given.z), sunShare(given.xy)); }`;
  const { gl, at, run: runShader } = openShader(vertex);
  const run = (...given) => {
    gl.uniform3fv(at("given"), given);
    return runShader();
  };
  const texture = createShadowTexture(gl), made = createShadows(createHeights({ kind: "hills", ...hills }), side);
  const ratios = lights.map(({ direct, ambient, sun, slopes, visible }) => {
    gl.uniform3fv(at("toSun"), placeSun(...sun).direction);
    gl.uniform3fv(at("direct"), direct);
    gl.uniform3fv(at("ambient"), ambient);
    return slopes.map((slope, k) => run(...slope, visible[k]).slice(0, 3).map(v => v ** 2.2));
  });
  const turns = [], low = placeSun(elevation, azimuth);
  do turns.push(performance.now()); while (!made.step(eye[0], eye[1], low, 0));
  const { margins, first, cell, soft } = made.made, size = Math.sqrt(margins.length);
  const uniforms = Object.fromEntries(["shadowUnder", "shadowScale", "soft"].map(name => [name, at(name)]));
  texture.set(uniforms, made.made, eye);
  const drawn = points.map(([x, y]) => run(x - eye[0], y - eye[1], 1)[3]);
  const exact = points.map(([x, y]) => { // bilinear
    const u = (x - first[0]) / cell, v = (y - first[1]) / cell, i = Math.floor(u), j = Math.floor(v);
    const row = (b) => margins[b * size + i] * (1 - u + i) + margins[b * size + i + 1] * (u - i);
    return Math.min(Math.max(0.5 + (row(j) * (1 - v + j) + row(j + 1) * (v - j)) / (2 * soft), 0), 1);
  });
  return { ratios, drawn, exact, turns: turns.length };
}"""
)


def test_the_light_below_a_sun_is_that_of_the_library(modules):
    found = modules.evaluate(BELOW, GOLDEN["lights"])
    for case, own in zip(GOLDEN["lights"], found, strict=True):
        for name in ("captured_hour", "sun", "direct", "ambient", "new_zenith", "new_horizon", "sun_colour"):
            np.testing.assert_allclose(own[name], case[name], rtol=0, atol=1e-9, err_msg=name)
        above = np.array(case["rays"])[:, 2] > 0
        # a pixel's byte rounds by half a step; float32 has the sun's edge, 8e-5 wide, to a thousandth
        np.testing.assert_allclose(np.array(own["shown"])[above], np.array(case["shown"])[above], atol=0.5 / 255 + 2e-3)


def test_ground_has_the_light_and_the_shadows_of_the_library(modules):
    found = modules.evaluate(SHADED, GOLDEN)
    np.testing.assert_allclose(found["ratios"], [case["ratios"] for case in GOLDEN["lights"]], rtol=1e-5, atol=1e-6)
    visible = GOLDEN["shadows"]["visible"]
    np.testing.assert_allclose(found["exact"], visible, rtol=0, atol=1e-5)
    # half floats, and cards that interpolate in steps of 1/256 of a texel
    np.testing.assert_allclose(found["drawn"], visible, rtol=0, atol=0.03)
    assert found["turns"] > 50, "nobody waits for long"


@pytest.fixture(scope="module")
def hilly(page_of):
    """The folder of a page of hills that knows its sun."""
    return page_of(GROUND, surface=HILLS, edit=lambda manifest: manifest.update(light=LIGHT))


@pytest.fixture(scope="module")
def address(hilly):
    with served(hilly) as address:
        yield address


def choose(seen: Visit, sun) -> None:
    seen.page.evaluate("async sun => (await import('./main.js')).viewer.showSun(sun)", sun)


def test_the_sun_is_switched_off_without_a_trace(still, page_of, address):
    with served(page_of(GROUND, surface=HILLS)) as plain:
        expected = still(plain, 160, 100).at(**PLACE)
    seen = still(address, 160, 100)
    choose(seen, "off")
    assert (seen.at(**PLACE) == expected).all()
    choose(seen, None)
    lit = seen.picture()
    assert np.abs(lit - expected).max() > 20
    choose(seen, 12)
    noon = seen.picture()
    choose(seen, 17)
    evening = seen.picture()
    assert np.abs(noon - evening)[60:].mean() > 5
    choose(seen, None)
    assert (seen.picture() == lit).all()


def test_level_ground_is_lit_as_captured_and_darker_in_the_evening(still, page_of, plain):
    expected = still(plain, 160, 100).at(**PLACE)
    with served(page_of(Ground(), edit=lambda manifest: manifest.update(light=LIGHT))) as sunny:
        seen = still(sunny, 160, 100)
        assert np.abs(seen.at(**PLACE) - expected).max() <= 1, "rounding"
        choose(seen, 17)
        assert seen.picture()[60:].mean() < 0.9 * expected[60:].mean()


@pytest.mark.parametrize(
    "part, sun",
    [("", None), ("&sun=14.5", 14.5), ("&sun=off", "off"), ("&sun=", None), ("&sun=NaN", None), ("&sun=%", None)],
)
def test_an_address_tells_the_sun(call, part, sun):
    assert call("ui/address.js", "parseSun", f"#3,5,2{part}&paint=AbC") == sun
    place = dict(x=3, y=-5, eye=2, yaw=20, pitch=-30.5, floor=0.5, radius=0)
    told = call("ui/address.js", "formatAddress", place, 2, "AbC", sun)
    assert told.endswith(f"&show=level{part if sun else ''}&paint=AbC")


@pytest.mark.slow
def test_slider_key_and_address_move_the_sun_and_pictures_at_rest_have_its_shadows(visit, still, address):
    where = f"{address}#3,5,2,60,-12"
    seen = visit(480, 300).open(f"{where}&sun=9")
    seen.until("davgswt.state.whole")
    slider, clock, key = seen.page.locator("#hour"), seen.page.locator("#clock"), seen.page.keyboard
    assert clock.text_content() == "9:00"
    seen.page.locator("#menuButton").click()
    slider.focus()
    for _ in range(2):
        key.press("ArrowRight")
    assert clock.text_content() == "9:30" and slider.get_attribute("aria-valuetext") == "9:30, solar time"
    seen.until("location.hash.endsWith('&sun=9.5')")
    rest = Visit.decode(*seen.page.evaluate("davgswt.grab()"))
    expected = still(address, 480, 300)
    choose(expected, 9.5)
    assert (rest == expected.at(**PLACE)).all()
    seen.page.locator("#capturedSun").click()
    hour = int(CAPTURED * 60 + 0.5)
    assert clock.text_content() == f"{hour // 60}:{hour % 60:02}"
    seen.until("!location.hash.includes('sun')")
    key.press("k")
    seen.until("location.hash.endsWith('&sun=off')")
    assert slider.is_disabled() and seen.page.locator("#lightButton").get_attribute("aria-pressed") == "false"
    key.press("k")
    assert slider.is_enabled()
    seen.page.evaluate("location.hash = '#3,5,2,60,-12&sun=6'")
    # 3 degrees above the horizon at 4.51 degrees of the day's circle: sin 3 sqrt(0.72^2 + 0.643^2) / 0.643
    seen.until("clock.textContent === '6:18'")


def test_a_terrain_without_a_sun_has_no_slider(still, plain):
    assert still(plain).page.evaluate("daylight.hidden")


def test_painters_of_other_pages_follow_the_sun(blank, still, address):
    expected = still(address, 160, 100)
    choose(expected, 17)
    picture = expected.at(**PLACE)
    tab = blank(address)
    sun, drawn, complete, refused = tab.evaluate(
        """async (place) => {
          const { load } = await import("./terrain_api.js");
          const canvas = Object.assign(document.createElement("canvas"), { width: 160, height: 100 });
          const gl = canvas.getContext("webgl2", { alpha: false, antialias: false });
          const terrain = await load("."), camera = terrain.camera(place, 160, 100), bytes = new Uint8Array(4 * 16000);
          await terrain.loaded;
          const painter = terrain.createPainter(gl), captured = terrain.sun;
          terrain.setSun(17);
          const { complete } = await terrain.update(camera, { exact: true });
          painter.draw(camera);
          gl.readPixels(0, 0, 160, 100, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
          const { sun } = terrain, refused = [];
          terrain.setSun("off");
          refused.push(terrain.sun);
          for (const hour of [NaN, "noon", undefined]) {
            try { terrain.setSun(hour); } catch (error) { refused.push(error.name); }
          }
          const { chooseSun } = await import("./api/parts.js"), dark = { light: null };
          for (const none of [null, "off"]) chooseSun(dark, none); // as it is already
          try { chooseSun(dark, 12); } catch (error) { refused.push(error.name); }
          return [[captured, sun], btoa(Array.from(bytes, (v) => String.fromCharCode(v)).join("")), complete, refused];
        }""",
        PLACE,
    )
    assert complete and (Visit.decode(160, 100, drawn) == picture).all()
    assert (sun[0]["elevation"], sun[0]["azimuth"]) == (40, 200) and sun[0]["hour"] == pytest.approx(CAPTURED)
    assert sun[1]["hour"] == 17 and sun[1]["azimuth"] > 240
    assert refused == [None, "TypeError", "TypeError", "TypeError", "TypeError"]
