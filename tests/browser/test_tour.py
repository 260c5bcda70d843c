"""The tour: a flight without anybody at the controls, smooth and above the ground, until somebody touches anything."""

import numpy as np
import pytest

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
