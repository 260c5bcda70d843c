"""Wind: what sways, where pictures change, and when the page draws them."""

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.bundles import Ground
from fixtures.frame_counts import COUNT_CALLS
from fixtures.page_visit import Visit
from scipy.ndimage import binary_dilation

PLACE = dict(x=3.0, y=5.0, eye=1.0, yaw=60.0, pitch=-20.0)
BLOWN = """async (seconds) => {
  const { load } = await import("./terrain_api.js"), bytes = new Uint8Array(4 * 16000);
  const canvas = Object.assign(document.createElement("canvas"), { width: 160, height: 100 });
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false });
  const terrain = await load("."), camera = terrain.camera(PLACE, 160, 100), painter = terrain.createPainter(gl);
  await terrain.loaded;
  await terrain.update(camera, { exact: true });
  return [undefined, ...seconds].map((seconds) => {
    painter.draw(camera, { seconds });
    gl.readPixels(0, 0, 160, 100, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return [160, 100, btoa(Array.from(bytes, (v) => String.fromCharCode(v)).join(""))];
  });
}""".replace("PLACE", str(PLACE))
STEM = """async ([tile, level, heights, radius]) => {
  // of a chunk of Gaussians at heights in steps of 0.1, on ground at 0.5, with the eye at least at 10
  const { measureStem } = await import("./draw/wind.js");
  const levels = [{ mean_scale: 0.1 }, { mean_scale: 0.5 }];
  const manifest = { tiles: Array(16), materials: [{}], eye_floor: 10, levels,
    objects: [{ radius, ground: 0.5 }], encoding: { origin: [0, 0, -1], step: [1, 1, 0.1] } };
  const records = Uint32Array.from(heights.flatMap(z => [0, 10 + 10 * z, 0, 0]));
  return measureStem(manifest, { tile, level, records });
}"""
BLOW = """async ([gap, took, turns]) => {
  // share of the wind after each turn; `turns`: [how many, what there is]
  const { createWind } = await import("./ui/weather.js"), wind = createWind(), shares = [];
  for (const [many, there] of turns) for (let k = 0; k < many; k++) {
    if (there.on !== undefined) wind.switch(there.on);
    wind.step(gap, took, { sways: true, whole: false, moving: false, ...there });
    shares.push(wind.now?.share ?? 0);
  }
  return shares;
}"""
REST, WALK, STOP = {"whole": True}, {"moving": True}, {}


def edit(manifest: dict) -> None:
    """Strong wind, and Gaussians that are fine enough to show it."""
    manifest["wind"] = 4.0
    for level in manifest["levels"]:
        del level["mean_scale"]


@pytest.fixture(scope="module")
def windy(page_of):
    with served(page_of(Ground(things=4), edit=edit)) as address:
        yield address


def test_only_what_stands_moves_and_still_air_leaves_no_trace(blank, still, page_of, windy):
    with served(page_of(Ground(things=4))) as calm, served(page_of(Ground())) as bare:
        expected, ground = still(calm, 160, 100).at(**PLACE), still(bare, 160, 100).at(**PLACE)
    assert (still(windy, 160, 100).at(**PLACE) == expected).all()
    quiet, first, later = (Visit.decode(*shown) for shown in blank(windy).evaluate(BLOWN, [0.5, 1.7]))
    assert (quiet == expected).all()
    stands = binary_dilation((expected != ground).any(2), iterations=3)  # a plant moves by less than three pixels here
    for before, after in ((quiet, first), (first, later)):
        moved = (before != after).any(2)
        assert moved.sum() > 20 and not moved[~stands].any()


@pytest.mark.parametrize(
    "tile, level, heights, radius, stem",
    [
        pytest.param(16, 0, [0, 0.5, 2], 1.5, [0, 2], id="shrub"),
        pytest.param(16, 0, [0, 0.5, 1], 1.5, [0, 0], id="stone"),
        pytest.param(16, 1, [0, 0.5, 2], 1.5, [0, 0], id="coarse shrub"),
        pytest.param(3, 0, [*[0.5] * 98, 1.2, 1.3], 1, [1.1, 1], id="grass"),
        pytest.param(3, 0, [*[0.5] * 300, 1.2, 1.3], 1, [1.1, 0], id="a stone in a tile"),
        pytest.param(3, 0, [1.0] * 9, 1, [1.1, 0], id="ripples"),
    ],
)
def test_what_sways_is_high_for_its_width_or_stands_above_the_ground(modules, tile, level, heights, radius, stem):
    assert modules.evaluate(STEM, [tile, level, heights, radius]) == pytest.approx(stem, abs=1e-9)


@pytest.mark.parametrize(
    "gap, took, turns, last",
    [
        pytest.param(20, 10, [(99, REST)], 0.999, id="rises in two seconds"),
        pytest.param(20, 10, [(100, REST), (100, WALK)], 1, id="goes on with a walk"),
        pytest.param(20, 10, [(100, REST), (5, WALK), (10, STOP)], 0, id="is still before a picture at rest begins"),
        pytest.param(20, 10, [(100, WALK)], 0, id="does not begin while moving"),
        pytest.param(20, 40, [(100, REST)], 0, id="slow pictures"),
        pytest.param(40, 10, [(100, REST)], 0, id="slow frames"),
        pytest.param(40, 10, [(100, REST), (1, {"on": True}), (10, REST)], 0.104, id="another trial"),
        pytest.param(20, 10, [(100, REST), (1, {"on": False}), (10, REST)], 0, id="off"),
        pytest.param(20, 10, [(100, REST | {"sways": False})], 0, id="nothing sways"),
    ],
)
def test_wind_blows_over_whole_pictures_on_fast_devices(modules, gap, took, turns, last):
    shares = modules.evaluate(BLOW, [gap, took, turns])
    assert shares[-1] == pytest.approx(last, abs=1e-3)
    assert np.abs(np.diff([0, *shares])).max() < 0.3, "nothing jumps"


@pytest.mark.parametrize("part", ["", "&wind=0", "&wind=1", "&wind=", "&wind=%"])
def test_an_address_tells_the_wind(call, part):
    on = part != "&wind=0"
    assert call("ui/address.js", "parseWind", f"#3,5,2{part}&paint=AbC") == on
    place = dict(x=3, y=-5, eye=2, yaw=20, pitch=-30.5, floor=0.5, radius=0)
    assert ("&wind=0&" in call("ui/address.js", "formatAddress", place, 2, "AbC", None, on)) == (not on)


@pytest.mark.slow
def test_a_page_at_rest_draws_in_the_wind_unless_it_is_off_or_less_motion_is_asked_for(visit, page_of):
    few = page_of(Ground(discs=4, things=4, levels=1), edit=edit)
    with served(few) as address:
        check_a_page_at_rest(visit(240, 160), f"{address}#3,5,1,60,-90")


def check_a_page_at_rest(seen: Visit, address: str) -> None:
    """Looking down on few Gaussians: any device draws them in time."""
    seen.page.add_init_script(COUNT_CALLS)
    seen.page.emulate_media(reduced_motion="reduce")
    seen.open(address)
    seen.until("davgswt.state.whole")

    def draws() -> int:
        before = seen.page.evaluate("glCounts.draws")
        seen.page.wait_for_timeout(500)
        return seen.page.evaluate("glCounts.draws") - before

    assert draws() == 0 and seen.page.evaluate("windButton.hidden")
    seen.page.emulate_media(reduced_motion="no-preference")
    calm = seen.page.evaluate("davgswt.grab()")
    count = seen.page.evaluate("glCounts.draws")
    toggle = "document.getElementById('windButton').click()"
    for trial in range(4):  # on a busy machine frames may be late, and then the wind waits for the button
        try:
            seen.until(f"glCounts.draws > {count + 10}", 10.0)
            break
        except AssertionError:
            if trial == 3:
                raise
            seen.page.evaluate(f"{toggle}; {toggle}")
    assert seen.page.evaluate("davgswt.grab()") == calm, "saved without wind"
    assert not seen.page.evaluate("windButton.hidden")
    seen.page.evaluate(toggle)
    seen.until("location.hash.includes('&wind=0')")
    assert draws() == 0
