"""Overlays, side by side or alone; fly paths, and the numbers about frames."""

import json

import numpy as np
import pytest
from fixtures.browser import served
from fixtures.bundles import Ground

OBLIQUE = dict(x=3.0, y=5.0, eye=2.0, yaw=20.0, pitch=-30.0)


@pytest.fixture(scope="module")
def uncertain(page_of):
    """A page whose tiles 0 to 7 have uncertainty 0 and whose others have 1."""

    def edit(manifest):
        for tile in manifest["tiles"]:
            tile["uncertainty"] = float(tile["tile"] >= 8)

    with served(page_of(Ground(), edit=edit)) as address:
        yield address


@pytest.mark.parametrize("overlay", ["tile", "level", "order"])
def test_an_overlay_paints_the_tiles_and_goes_again(still, uncertain, overlay):
    seen = still(uncertain, 160, 100)
    plain = seen.at(**OBLIQUE)
    seen.page.select_option("#overlay", overlay)
    painted = seen.picture()
    assert seen.state["overlay"] == overlay
    assert np.abs(painted - plain).mean() > 15
    seen.page.select_option("#overlay", "picture")
    assert (seen.picture() == plain).all()


def test_uncertain_tiles_are_warm_and_sure_ones_cool(still, uncertain):
    seen = still(uncertain, 160, 100)
    seen.page.evaluate("davgswt.overlay('uncertainty')")
    found = set()
    for i in range(6):
        picture = seen.at(x=(i + 0.5) * 4, y=2.0, eye=1.0, yaw=90, pitch=-90)
        red, _, blue = picture.mean((0, 1))
        tile = seen.state["under"]["tile"]
        assert (red > blue + 30) == (tile >= 8) and (blue > red + 30) == (tile < 8)
        found.add(tile >= 8)
    assert found == {True, False}


@pytest.mark.slow
def test_the_divider_has_the_terrain_on_its_left_and_is_dragged(visit, plain):
    seen = visit(480, 320).open(f"{plain}?still")
    terrain = seen.at(**OBLIQUE)
    seen.page.select_option("#overlay", "level")
    painted = seen.picture()
    seen.page.keyboard.press("b")
    both = seen.picture()
    assert (both[:, :240] == terrain[:, :240]).all() and (both[:, 240:] == painted[:, 240:]).all()
    seen.page.mouse.move(240, 100)
    seen.page.mouse.down()
    seen.page.mouse.move(120, 110, steps=3)
    seen.page.mouse.up()
    both = seen.picture()
    assert (both[:, :120] == terrain[:, :120]).all() and (both[:, 120:] == painted[:, 120:]).all()
    assert {k: seen.state[k] for k in OBLIQUE} == OBLIQUE


@pytest.mark.slow
def test_a_walk_is_recorded_played_and_saved(visit, plain):
    seen = visit(160, 100).open(plain)
    seen.at(**OBLIQUE)
    seen.page.keyboard.press("r")
    seen.page.keyboard.down("w")
    seen.until("davgswt.state.x > 3.3")
    seen.page.keyboard.up("w")
    seen.until("davgswt.flyPath.path.length > 2")
    seen.page.keyboard.press("r")
    end = seen.page.evaluate("davgswt.flyPath.path.at(-1)")
    seen.at(x=-50.0)
    seen.page.keyboard.press("p")
    seen.until("davgswt.flyPath.mode === 'rest'")
    assert seen.state["x"] == pytest.approx(end["x"]) and seen.state["yaw"] == pytest.approx(20.0)
    with seen.page.expect_download() as download:
        seen.page.locator("#save").dispatch_event("click")
    saved = json.loads(download.value.path().read_text())
    assert saved["path"][0]["x"] == pytest.approx(3.0) and saved["path"][-1] == end


def test_between_recorded_places_the_way_is_straight_and_turns_are_short(call):
    start, end = (
        dict(seconds=0, x=0, y=2, eye=1, yaw=350, pitch=0),
        dict(seconds=2, x=4, y=0, eye=3, yaw=10, pitch=-8),
    )
    places = [call("ui/fly_path.js", "placeAt", [start, end], seconds) for seconds in (-1, 1, 9)]
    assert places[1] == {"x": 2, "y": 1, "eye": 2, "yaw": 360, "pitch": -4}
    assert places[0]["x"] == 0 and places[2]["x"] == 4


def test_frame_times_have_means_and_deviations_of_the_last_120(modules):
    found = modules.evaluate(
        """async () => {
          const { createFrameStats } = await import("./draw/frame_stats.js"), stats = createFrameStats();
          for (let k = 0; k < 200; k++) {
            stats.addTime("sort", k < 80 ? 1000 : k % 2 ? 3 : 5);
            stats.addFrame(k % 4 === 0);
          }
          return stats.summary();
        }"""
    )
    assert found == {"share": 0.25, "sort": {"mean": 4, "sd": pytest.approx((120 / 119) ** 0.5), "n": 120}}
