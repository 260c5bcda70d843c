"""Virtual reality on a mock device: two eyes as the page itself would draw them, walking and turning."""

import math
from pathlib import Path

import numpy as np
import pytest
from fixtures.page_visit import Visit

MOCK = Path(__file__).with_name("xr_mock.js")
START = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=0.0)
HIGH = 1.6  # metres, the tests' unit: so high one stands


@pytest.fixture
def worn(visit, plain):
    """A visit in a session that was just entered at START."""

    def start(address=plain, **mock) -> Visit:
        seen = visit(400, 300)
        seen.page.add_init_script(path=MOCK)
        seen.open(address)
        seen.page.evaluate("place => davgswt.set(place)", START)
        seen.page.evaluate("values => Object.assign(xrMock, values)", mock)
        seen.page.locator("#menuButton").click()
        seen.page.get_by_role("button", name="Enter VR").click()
        seen.until("!!xrMock.session?.due")
        return seen

    return start


def frame(seen, settle: int = 6) -> np.ndarray:
    """The eyes' pictures when the worker has answered to them."""
    for _ in range(settle):
        seen.page.evaluate("xrMock.frame()")
        seen.page.wait_for_timeout(60)
    return seen.decode(*seen.page.evaluate("xrMock.frame()"))


def place(seen) -> tuple[float, float, float]:
    seen.page.evaluate("xrMock.frame(0)")
    return seen.state["x"], seen.state["y"], seen.state["yaw"]


@pytest.mark.slow
def test_each_eye_sees_what_the_page_would_show_from_there(worn, still, plain):
    fields = dict(left=1.0, right=0.5, down=1.125, up=1.125)
    seen = worn(fields=[fields, dict(fields, left=0.5, right=1.0)], head=[0.0, 1.6, 0.0, 0.0])
    both = frame(seen)
    yaw = math.radians(20)
    for eye, (cut, side) in enumerate([((0, 200), -1), ((66, 266), 1)]):
        # 200 pixels are 1.5 units of tangent: straight ahead lies 133 from the eye's far side, and the page shows
        # a picture 266 wide, of tangent 1, so its field of view is 90 degrees
        half = side * 0.032
        other = still(plain, 266, 300)
        other.page.evaluate("davgswt.walker.fieldOfView = 2 * Math.atan(150 / (200 / 1.5)) * 180 / Math.PI")
        spot = dict(START, eye=HIGH, x=3 + half * math.sin(yaw), y=5 - half * math.cos(yaw))
        expected = other.at(**spot)[50:250, cut[0] : cut[1]]
        found = both[50:250, 200 * eye : 200 * (eye + 1)]
        assert found.std() > 10
        assert np.abs(found - expected).mean() < 4, "as shown by the page, but for the order and half a pixel"
        assert np.abs(found - both[50:250, 200 * (1 - eye) : 200 * (2 - eye)]).mean() > 4, "eyes differ"


@pytest.mark.slow
def test_the_left_stick_walks_where_one_looks_and_the_right_one_turns_in_steps_about_the_head(worn):
    seen = worn(head=[0.5, 1.6, -0.3, math.pi / 2])  # a quarter to the left: 110 degrees
    before = place(seen)
    seen.page.evaluate("xrMock.session.inputSources = [{ handedness: 'left', gamepad: { axes: [0, 0, 0, -1] } }]")
    for _ in range(20):
        seen.page.evaluate("xrMock.frame(50)")
    walked = place(seen)
    way, yaw = 20 * 0.05 * 1.5, math.radians(110)
    assert np.subtract(walked[:2], before[:2]) == pytest.approx([way * math.cos(yaw), way * math.sin(yaw)], abs=1e-4)
    assert walked[2] == pytest.approx(110, abs=1e-3) and seen.state["eye"] == pytest.approx(HIGH)
    for push, steps in [(1, 1), (0, 1), (1, 2)]:
        source = f"{{ handedness: 'right', gamepad: {{ axes: [0, 0, {push}, 0] }} }}"
        seen.page.evaluate(f"xrMock.session.inputSources = [{source}]")
        for _ in range(5):
            seen.page.evaluate("xrMock.frame()")
        assert place(seen) == pytest.approx((*walked[:2], 110 - 30 * steps), abs=1e-3)


def test_an_eye_that_looks_to_one_side_has_a_camera_that_reaches_beyond(modules):
    found = modules.evaluate(
        """async () => {
          const { eyeCamera, placed } = await import("./ui/xr_rig.js");
          const rig = { x: 10, y: 20, turn: 0, scale: 1, floor: 0 };
          const p = new Float32Array(16);
          [p[0], p[5], p[8], p[9]] = [1, 0.5, -0.25, 0.125];
          const view = { projectionMatrix: p, transform: { position: {}, matrix: new Float32Array(16) } };
          const { camera, around } = eyeCamera(rig, view, { x: 100, y: 0, width: 80, height: 60 }, [0, 0, 0]);
          return [placed(rig, { x: 1, y: 1.7, z: -3 }, () => 5, { x: 0, y: 0, z: 0 }), camera, around];
        }"""
    )
    at, camera, around = found
    assert at == pytest.approx([13, 19, 6.7])
    # left 1.25, right 0.75, down 1.75, up 2.25 of tangent: 40 pixels a unit across, 15 along
    assert camera["focal"] == pytest.approx(40) and camera["width"] == 100
    assert around == {"x": 100, "y": -8, "width": 100, "height": 68}
    assert camera["height"] / 2 / camera["focal"] == pytest.approx(34 / 15)
